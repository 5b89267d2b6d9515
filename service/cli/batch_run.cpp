#include "cli/batch_run.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include "batch/frames.h"
#include "batch/leftovers.h"
#include "batch/movie.h"
#include "batch/report.h"
#include "cli/batch_frame.h"
#include "cli/batch_nights.h"
#include "cli/batch_pace.h"
#include "cli/batch_server.h"
#include "cli/progress_bar.h"
#include "cli/running_mark.h"
#include "output/output_files.h"
#include "output/stats_json.h"
#include "process/clock.h"
#include "process/exit_code.h"
#include "process/interrupt.h"
#include "process/program.h"
#include "rcs/error.h"
#include "report/encoding.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// What other tasks have left of a frame that is not done.
void tell_failure(const std::string& record, FrameResult& result)
{
    std::ifstream note(failed_path(record));
    result.error.assign(std::istreambuf_iterator<char>(note), {});
    const int starts = starts_without_end(running_path(record));
    if (starts > 0) result.error = "begun " + std::to_string(starts) + " times by tasks that have not ended it";
    if (!result.error.empty()) result.end = FrameEnd::failed;
}

class Batch {
public:
    explicit Batch(const BatchArguments& arguments);
    void run();

private:
    FrameResult make(int number);
    std::string why_by_files(const std::optional<FrameRecord>& record, FrameRecord& wanted) const;
    std::string why_render(const std::optional<FrameRecord>& record, FrameRecord& wanted);
    void clean_up() const;
    std::vector<int> order() const;
    std::set<int> waiting() const;
    void begin_task();
    FrameResult& slot_of(int number);
    void render(FrameRecord& wanted, FrameResult& result);
    void take(const FrameRecord& frame, const Failure& failure);
    void take_asked();
    void tell(const FrameResult& result) const;
    bool renders() const { return !arguments_.plan_only && arguments_.task.kind != TaskKind::report; }
    bool reports() const { return arguments_.task.kind == TaskKind::all || arguments_.task.kind == TaskKind::report; }
    void write_report();
    void thin_out(FrameResult& slot) const;
    void show_movie();
    void remove_nights();
    void end();

    const BatchArguments& arguments_;
    const Clock::time_point began_ = Clock::now();
    const double cpu_began_ = cpu_seconds();
    ProgressBar bar_;
    FrameMaker maker_;
    BatchPace pace_;
    std::optional<ServerFrames> server_;  // makes them; none: maker_
    BatchReport report_;
    std::string report_folder_;
    bool rendered_before_ = false;  // some frame of this run is not as it was
};

Batch::Batch(const BatchArguments& arguments)
    : arguments_(arguments),
      bar_(parse_log_level(arguments.render.report.log_level), arguments.render.report.quiet),
      maker_(arguments, bar_, [this] { write_report(); }),
      pace_(arguments, maker_)
{
    for (const int number : frames_of(arguments.task, parse_frames(arguments.frames)))
        report_.frames.emplace_back().number = number;
    const fs::path first = fs::path(arguments.render.output.files.front()).parent_path();
    report_folder_ = arguments.report_folder.empty() ? first.string() : arguments.report_folder;
    if (!report_folder_.empty() && reports()) fs::create_directories(report_folder_);
    report_.scene = fs::path(arguments.render.scene.scene).filename().string();
    report_.command = arguments.command_line;
    report_.fps = arguments.shutter.fps;
    report_.width = maker_.options().width;
    report_.height = maker_.options().height;
    report_.threads = maker_.threads();
    report_.independent = arguments.independent;
    report_.began = local_text(read_clocks().wall_ms);
    if (arguments.on_server) {
        report_.server = arguments.server.address;
        server_.emplace(arguments, maker_, bar_,
                        [this](const FrameRecord& frame, const Failure& failure) { take(frame, failure); });
    }
    install_batch_signal_handlers();
}

/// Frames that two runs did not live through come last, so that they cannot keep the others from being made.
std::vector<int> Batch::order() const
{
    std::vector<int> first, last;
    for (const FrameResult& frame : report_.frames) {
        const std::string path = record_path(maker_.paths_of(frame.number).front());
        (starts_without_end(running_path(path)) > 1 ? last : first).push_back(frame.number);
    }
    first.insert(first.end(), last.begin(), last.end());
    return first;
}

/// What the files say: scene and camera are taken for what they were. @return "" if the frame seems done
std::string Batch::why_by_files(const std::optional<FrameRecord>& record, FrameRecord& wanted) const
{
    if (arguments_.overwrite) return "it was asked for anew";
    if (!record) return "it was never rendered";
    const auto as_before = [&](const char* what) {
        for (auto& [name, text] : wanted.depends)
            for (const auto& [old_name, old_text] : record->depends)
                if (name == what && old_name == what) text = old_text;
    };
    as_before("scene");
    as_before("camera");
    // One that was held before holds on; in a dry run the frames that would say which are not rendered.
    if (maker_.shows_as_held(*record) || maker_.finds_exposure() || (!renders() && rendered_before_))
        as_before("exposure");
    if (const std::string why = difference(record->depends, wanted.depends); !why.empty()) return why;
    return missing_file(*record, wanted.files, fs::path(maker_.paths_of(wanted.number).front()).parent_path().string());
}

/// @return "" if the frame is done
std::string Batch::why_render(const std::optional<FrameRecord>& record, FrameRecord& wanted)
{
    if (const std::string why = why_by_files(record, wanted); !why.empty()) return why;
    if (record->source == wanted.source) return {};
    maker_.identify(wanted);
    return difference(record->depends, wanted.depends);
}

/// Frames that are to be rendered, as far as that can be told before.
std::set<int> Batch::waiting() const
{
    std::set<int> numbers;
    for (const FrameResult& frame : report_.frames) {
        try {
            const auto record = read_frame_record(record_path(maker_.paths_of(frame.number).front()));
            FrameRecord wanted = maker_.wanted(frame.number);
            const bool done = why_by_files(record, wanted).empty() && record->source == wanted.source;
            if (!done) numbers.insert(frame.number);
        } catch (const Error&) {  // it will fail, and takes no time
        }
    }
    return numbers;
}

FrameResult& Batch::slot_of(int number)
{
    return *std::lower_bound(report_.frames.begin(), report_.frames.end(), number,
                             [](const FrameResult& frame, int wanted) { return frame.number < wanted; });
}

/// Here and now, or with others by the server, which take() is told of.
void Batch::render(FrameRecord& wanted, FrameResult& result)
{
    if (server_) return server_->ask(wanted);
    maker_.render(wanted);
    result.end = FrameEnd::rendered;
    result.figures = wanted.figures;
    maker_.hold_exposure(result.figures);
    if (arguments_.task.kind == TaskKind::overture) maker_.save_records();
}

void Batch::take(const FrameRecord& frame, const Failure& failure)
{
    FrameResult& slot = slot_of(frame.number);
    const bool is_news = slot.end == FrameEnd::left;
    if (is_news) slot.end = failure.why.empty() ? FrameEnd::rendered : FrameEnd::failed;
    slot.error = failure.why;
    slot.log = failure.log;
    slot.figures = frame.figures;
    if (slot.end == FrameEnd::rendered) maker_.hold_exposure(slot.figures);
    thin_out(slot);
    if (is_news) tell(slot);
}

/// Waits for what the server was asked for.
void Batch::take_asked()
{
    if (server_ && interrupt_signal() == 0) server_->take_all();
}

FrameResult Batch::make(int number)
{
    FrameResult result;
    result.number = number;
    result.files = maker_.paths_of(number);
    maker_.forget_log();
    try {
        maker_.check_scene();
        FrameRecord wanted = maker_.wanted(number);
        const std::string path = record_path(result.files.front());
        auto record = read_frame_record(path);
        result.why = why_render(record, wanted);
        if (result.why.empty()) {
            std::error_code ignored;
            if (renders()) fs::remove(running_path(path), ignored);  // it died once all was written
            if (record->source != wanted.source && renders()) {
                record->source = wanted.source;
                write_frame_record(path, *record);
            }
            result.end = FrameEnd::kept;
            result.figures = record->figures;
            maker_.hold_exposure(result.figures);
        } else if (renders()) {
            render(wanted, result);
        } else if (arguments_.task.kind == TaskKind::report) {
            tell_failure(path, result);
        }
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled && interrupt_signal() != 0) throw;
        result.end = FrameEnd::failed;
        result.error = e.what();
        result.log = maker_.log_so_far();
        if (renders() && !reports()) write_text_file(failed_path(record_path(result.files.front())), result.error);
    }
    return result;
}

void Batch::tell(const FrameResult& result) const
{
    if (arguments_.render.report.quiet) return;
    std::printf("%s\n", line_of(result, arguments_.explain || arguments_.plan_only).c_str());
    std::fflush(stdout);
}

/// Keeps small pictures, and the memory that they take, of as many frames as the page shows.
void Batch::thin_out(FrameResult& slot) const
{
    const auto index = static_cast<std::size_t>(&slot - report_.frames.data());
    if (index % picture_step(report_.frames.size()) != 0) std::string().swap(slot.figures.thumbnail);
}

void Batch::write_report()
{
    if (!reports()) return;
    report_.ended = local_text(read_clocks().wall_ms);
    if (arguments_.task.kind == TaskKind::report) {
        add_up(report_);
    } else {
        report_.seconds = seconds_since(began_);
        report_.ahead_seconds = maker_.ahead_seconds();
        report_.cpu_seconds = server_ ? cpu_of_rendered(report_) : cpu_seconds() - cpu_began_;
        report_.peak_memory = peak_memory();
    }
    write_text_file((fs::path(report_folder_) / "report.json").string(),
                    to_json(report_).dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    write_text_file((fs::path(report_folder_) / "report.html").string(), to_html(report_));
}

/// Of the first output that others can show, as far as its frames are there. A movie is a help: without it all is well.
void Batch::show_movie()
{
    const std::string file = (fs::path(report_folder_) / kMovieFile).string();
    std::vector<std::string> pictures;
    for (const FrameResult& frame : report_.frames) {
        if (frame.end != FrameEnd::rendered && frame.end != FrameEnd::kept) continue;
        const auto shown = std::find_if(frame.files.begin(), frame.files.end(),
                                        [](const std::string& path) { return !is_exr({path, {}}); });
        if (shown != frame.files.end()) pictures.push_back(*shown);
    }
    std::error_code ignored;
    const bool is_there = fs::exists(file, ignored);
    const bool is_new = rendered_before_ || arguments_.task.kind == TaskKind::report || !is_there;
    const std::string maker = is_new && pictures.size() > 1 ? find_program("ffmpeg") : "";
    report_.has_movie = is_there && !is_new;
    if (maker.empty()) return;
    bar_.log()(LogLevel::info, "making " + file);
    const std::string why = make_movie(maker, pictures, arguments_.shutter.fps, file);
    if (!why.empty()) bar_.log()(LogLevel::warning, file + " is not made: " + why);
    report_.has_movie = why.empty();
}

/// Takes away what runs that were killed have left. @throws rcs::Error bad_argument: two frames would be one file
void Batch::clean_up() const
{
    std::set<std::string> names, scratch;
    for (const FrameResult& frame : report_.frames) {
        const std::vector<std::string> paths = maker_.paths_of(frame.number);
        for (const std::string& path : paths)
            if (!names.insert(path).second)
                throw Error(ErrorCode::bad_argument, "--output: two of the frames' files would be " + path);
        const std::string record = record_path(paths.front());
        names.insert({record, running_path(record), thumbnail_path(record), job_path(record)});
        scratch.insert(thumbnail_path(record));
    }
    if (arguments_.task.kind == TaskKind::report) return;  // others may be at work
    for (const std::string& report : report_files())
        if (reports()) names.insert((fs::path(report_folder_) / report).string());
    remove_leftovers(names, scratch);
}

/// What a task needs that does not have all frames. @throws rcs::Error not_found
void Batch::begin_task()
{
    if (arguments_.task.kind != TaskKind::part && arguments_.task.kind != TaskKind::report) return;
    const std::vector<int> all = parse_frames(arguments_.frames);
    maker_.take_exposure(all);
    if (arguments_.task.kind == TaskKind::part && maker_.finds_exposure() &&
        report_.frames.front().number != all.front())
        throw Error(ErrorCode::not_found,
                    "the exposure of all frames, which the first one finds, is not known: run "
                    "--task overture/" +
                        std::to_string(arguments_.task.parts) + " before, or give --exposure");
}

/// Of earlier nights, what is not to be kept: not before this one is whole.
void Batch::remove_nights()
{
    report_.removed = remove_old_nights(arguments_, !arguments_.plan_only);
    for (const std::string& line : report_.removed)
        if (!arguments_.render.report.quiet) std::printf("%s\n", line.c_str());
}

void Batch::run()
{
    clean_up();
    begin_task();
    if (arguments_.deadline_ms && renders()) pace_.begin(waiting());
    for (const int number : order()) {
        if (interrupt_signal() != 0) break;
        if (take_report_request()) write_report();
        FrameResult& slot = slot_of(number);
        try {
            pace_.aim(number);
            slot = make(number);
            pace_.learn(slot);
            thin_out(slot);
            rendered_before_ = rendered_before_ || slot.end != FrameEnd::kept;
            bar_.finish();
            const bool is_asked = server_ && renders() && slot.end == FrameEnd::left;
            if (!is_asked) tell(slot);
            if (is_asked && maker_.finds_exposure()) take_asked();  // the next ones are shown with what it finds
        } catch (const Error& e) {
            if (e.code() != ErrorCode::cancelled) throw;
            break;
        }
    }
    try {
        take_asked();
    } catch (const Error& e) {
        if (e.code() != ErrorCode::cancelled) throw;
    }
    bar_.finish();
    const std::size_t there = report_.count(FrameEnd::rendered) + report_.count(FrameEnd::kept);
    if (reports() && (there == report_.frames.size() || arguments_.plan_only)) remove_nights();
    if (arguments_.plan_only) return;
    if (arguments_.task.kind == TaskKind::all) maker_.save_records();
    if (reports() && arguments_.makes_movie && interrupt_signal() == 0) show_movie();
    write_report();
    if (reports()) note_report(arguments_, report_folder_);
    end();
}

void Batch::end()
{
    const std::string head = headline(report_);
    const std::string page = (fs::path(report_folder_) / "report.html").string();
    if (!arguments_.render.report.quiet) {
        std::printf("%s\n", head.c_str());
        if (reports()) std::printf("report   %s\n", page.c_str());
    }
    if (interrupt_signal() != 0)
        throw Ended(kSignalBase + interrupt_signal(), "interrupted: " + head + "; the same command goes on");
    const std::string teller = reports() ? page : "the output above";
    if (report_.count(FrameEnd::failed) + report_.count(FrameEnd::left) > 0)
        throw Ended(kFailed, head + "; " + teller + " says why");
    const bool warned = std::any_of(report_.frames.begin(), report_.frames.end(),
                                    [](const FrameResult& frame) { return !frame.figures.warnings.empty(); });
    if (warned) throw Ended(kWarned, head + ", with warnings, which " + teller + " lists");
}

}  // namespace

void run_batch(const BatchArguments& arguments) { Batch(arguments).run(); }

}  // namespace rcs::service
