#include "cli/batch_server.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/job_run.h"
#include "output/stats_json.h"
#include "process/interrupt.h"
#include "process/printable.h"
#include "rcs/fingerprint.h"
#include "rcs/image_io.h"
#include "report/encoding.h"
#include "wire/files.h"
#include "wire/framing.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

// Frames of a job: what a server says of one stays small, and so does what it is told.
constexpr std::size_t kFramesOfJob = 250;
// That wait in the server: workers go from one to the next.
constexpr std::size_t kJobsAtOnce = 2;
constexpr const char* kLabel = "batch";  // of jobs: by it they are found again

/// What a frame's mark says: the label of its job, and what was asked for.
std::string first_word(const std::string& file)
{
    std::ifstream mark(file);
    std::string word;
    mark >> word;
    return word;
}

std::string text_of(const std::string& file)
{
    std::ifstream mark(file);
    return {std::istreambuf_iterator<char>(mark), {}};
}

FrameFigures figures_of(const v1::FrameStatus& frame)
{
    using Json = nlohmann::ordered_json;
    FrameFigures figures;
    figures.tries = frame.attempts();
    figures.warnings.assign(frame.warnings().begin(), frame.warnings().end());
    try {
        const Json stats = Json::parse(frame.stats_json());
        figures.seconds = stats.at("seconds");
        figures.cpu_seconds = stats.at("cpu_seconds");
        figures.error = stats.at("error_estimate").at("image").at("mean_relative");
        figures.indirect_error = stats.at("error_estimate").at("indirect").at("mean_relative");
        figures.records_made = stats.at("records");
        figures.exposure = stats.at("tone_map").at("exposure");
        for (const auto& [kind, count] : stats.at("rays").items())
            if (kind != "refining") figures.rays += count.get<std::uint64_t>();  // those are among the hemispheres'
        return figures;
    } catch (const Json::exception& e) {
        throw Error(ErrorCode::io, std::string("what the server says of it is not complete: ") + e.what());
    }
}

/// What shows how much a frame differs from another; none: it has no EXR file.
std::optional<FlickerFrame> seen_in(const FrameRecord& record, const std::string& folder)
{
    const auto file = std::find_if(record.files.begin(), record.files.end(),
                                   [](const FrameFile& one) { return is_exr({one.name, {}}); });
    if (file == record.files.end()) return std::nullopt;
    return flicker_frame(read_image((fs::path(folder) / file->name).string()), "beauty");
}

/// What asks a server, and throws what it says, with errors of the library alone.
template <typename Ask>
void in_library_errors(const Ask& ask)
{
    try {
        ask();
    } catch (const ServiceError& e) {
        throw Error(from_wire(e.code()), e.what());
    }
}

}  // namespace

ServerFrames::ServerFrames(const BatchArguments& arguments, FrameMaker& maker, ProgressBar& bar, Taker taker)
    : arguments_(arguments),
      maker_(maker),
      bar_(bar),
      taker_(std::move(taker)),
      numbers_(parse_frames(arguments.frames))
{
}

void ServerFrames::ask(FrameRecord wanted)
{
    if (!following_) {
        following_.emplace(connect(arguments_.server, Patience::of_a_waiting_client));
        asking_.emplace(connect(arguments_.server, Patience::of_a_waiting_client));
    }
    maker_.identify(wanted);
    asked_.insert_or_assign(wanted.number, std::move(wanted));
}

std::string ServerFrames::mark_of(const FrameRecord& frame, const std::string& key) const
{
    Fingerprint print;
    print.add(frame.source);
    for (const auto& [name, text] : frame.depends) print.add(name + " " + text);
    for (const FrameFile& file : frame.files) print.add(file.name + " " + file.kept);
    return key + " " + print.text() + "\n";
}

/// Those that make frames which are asked for now, of a run that ended before them.
std::vector<ServerFrames::Job> ServerFrames::jobs_of_before()
{
    std::map<std::string, std::vector<int>> marked;
    for (const auto& [number, frame] : asked_) {
        const std::string mark = job_path(path_of(number)), key = first_word(mark);
        if (!key.empty() && text_of(mark) == mark_of(frame, key)) marked[key].push_back(number);
    }
    std::vector<Job> jobs;
    for (const auto& [key, numbers] : marked) {
        v1::Request request;
        request.mutable_list()->set_limit(1);
        (*request.mutable_list()->mutable_labels())[kLabel] = key;
        const v1::Response found = asking_->call(request);
        if (found.list().jobs_size() == 0) continue;  // it was never submitted, or has gone
        Job job;
        job.number = found.list().jobs(0).job();
        for_each_frame(*asking_, job.number, [&](const v1::FrameStatus& frame) {
            const bool comes = frame.state() != v1::FRAME_STATE_FAILED && frame.state() != v1::FRAME_STATE_CANCELLED;
            if (comes && std::find(numbers.begin(), numbers.end(), frame.number()) != numbers.end())
                job.frames.insert(asked_.extract(frame.number()));
        });
        if (!job.frames.empty()) jobs.push_back(std::move(job));
    }
    return jobs;
}

RequestedJob ServerFrames::request() const
{
    RequestedJob requested = request_job(arguments_.render, arguments_.shutter, false);
    requested.job.set_time_limit_seconds(arguments_.time_limit);
    if (const auto exposure = maker_.held_exposure()) requested.job.mutable_tone_map()->set_exposure(*exposure);
    return requested;
}

/// Asks for the next frames. @return none: they have ended already, in an error
std::optional<ServerFrames::Job> ServerFrames::submit_some()
{
    Job job;
    while (job.frames.size() < kFramesOfJob && !asked_.empty()) job.frames.insert(asked_.extract(asked_.begin()));
    try {
        in_library_errors([&] {
            RequestedJob requested = request();
            maker_.check_scene();  // it is the one that the frames' hashes are of
            const std::string key = random_id();
            requested.job.set_idempotency_key("batch-" + key);
            (*requested.job.mutable_labels())[kLabel] = key;
            for (const auto& [number, frame] : job.frames) {
                *requested.job.add_frames() = request_frame(arguments_.render, number, number / arguments_.shutter.fps);
                write_text_file(job_path(path_of(number)), mark_of(frame, key));  // before: it may be all that is left
            }
            job.number = submit(*asking_, requested, bar_).job();
        });
        return job;
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) throw;
        for (auto& [number, frame] : job.frames) end(frame, {e.what(), {}});
        return std::nullopt;
    }
}

void ServerFrames::take_all()
{
    std::vector<Job> jobs;
    try {
        if (!asked_.empty()) jobs = jobs_of_before();
        while (!asked_.empty() || !jobs.empty()) {
            while (!asked_.empty() && jobs.size() < kJobsAtOnce) {
                if (auto job = submit_some()) jobs.push_back(std::move(*job));
            }
            if (jobs.empty()) continue;
            follow_to_end(jobs.front());
            jobs.erase(jobs.begin());
        }
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) cancel(jobs);
        throw;
    }
}

void ServerFrames::follow_to_end(Job& job)
{
    try {
        in_library_errors([&] {
            const auto take_ended = [&] {
                for_each_ended(*asking_, job.number, job.first_open,
                               [&](std::uint32_t index, const v1::FrameStatus& frame) { take(job, index, frame); });
            };
            int known = 0;
            follow(*following_, job.number, bar_, [&](const v1::JobStatus& status) {
                maker_.answer_request();
                const int ended = status.frames_completed() + status.frames_failed() + status.frames_cancelled();
                if (std::exchange(known, ended) != ended) take_ended();
            });
            take_ended();
        });
        for (auto& [number, frame] : job.frames) end(frame, {"the server does not know it any more", {}});
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) throw;
        for (auto& [number, frame] : job.frames) end(frame, {e.what(), {}});
    }
}

void ServerFrames::take(Job& job, std::uint32_t index, const v1::FrameStatus& frame)
{
    auto found = job.frames.extract(frame.number());
    if (found.empty()) return;  // it was taken, or nobody asked for it
    FrameRecord& wanted = found.mapped();
    bar_.finish();
    if (frame.state() != v1::FRAME_STATE_COMPLETED) {
        const bool said = frame.has_error() && !frame.error().message().empty();
        const std::string why = said ? printable(frame.error().message()) : "it was " + state_text(frame.state());
        end(wanted, {why, log_of(job, frame.number())});
        return;
    }
    try {
        in_library_errors([&] { fetch(job, index, frame, wanted); });
        end(wanted, {});
    } catch (const Error& e) {
        if (e.code() == ErrorCode::cancelled) throw;
        end(wanted, {e.what(), {}}, false);  // the server has it still: the next run need not render it again
    }
}

void ServerFrames::fetch(const Job& job, std::uint32_t index, const v1::FrameStatus& frame, FrameRecord& wanted)
{
    const v1::JobReply details = asking_->details(job.number, index, 1);
    if (details.frames_size() == 0) throw Error(ErrorCode::io, "the server does not know it any more");
    wanted.figures = figures_of(details.frames(0));
    for (const std::string& warning : wanted.figures.warnings) bar_.log()(LogLevel::warning, printable(warning));
    maker_.forget(wanted);
    const std::vector<std::string> paths = maker_.paths_of(wanted.number);
    // Files come in the order of the job's outputs, which is that of the command line.
    if (static_cast<std::size_t>(frame.files_size()) != paths.size())
        throw Error(ErrorCode::io, "the server has " + std::to_string(frame.files_size()) + " files of it, expected " +
                                       std::to_string(paths.size()));
    for (std::size_t i = 0; i < paths.size(); ++i)
        asking_->fetch(job.number, wanted.number, details.job().outputs(static_cast<int>(i)).name(), paths[i]);
    const std::string small = thumbnail_path(path_of(wanted.number));
    asking_->fetch(job.number, wanted.number, "", small);
    wanted.figures.thumbnail = base64(read_part(small, 0, kMaxChunk));
    std::error_code ignored;
    fs::remove(small, ignored);
    tell_change(wanted);
    maker_.settle(wanted);
}

/// From the frame before it, and of the one after it, if those are there: several workers end in any order.
void ServerFrames::tell_change(FrameRecord& now) const
{
    const fs::path folder = fs::path(maker_.paths_of(now.number).front()).parent_path();
    const auto seen = seen_in(now, folder.string());
    if (!seen) return;
    const auto here = std::lower_bound(numbers_.begin(), numbers_.end(), now.number);
    const auto change = [&](int number, const auto& use) {
        const auto other = read_frame_record(path_of(number));
        const auto looks = other ? seen_in(*other, folder.string()) : std::nullopt;
        const bool is_still = other && other->depends.size() > 1 && other->depends[1] == now.depends[1];
        if (looks && (is_still || seen->motion)) use(*other, *looks);
    };
    if (here != numbers_.begin())
        change(*std::prev(here), [&](const FrameRecord&, const FlickerFrame& before) {
            now.figures.flicker = change_between(before, *seen);
        });
    if (std::next(here) != numbers_.end())
        change(*std::next(here), [&](FrameRecord after, const FlickerFrame& then) {
            after.figures.flicker = change_between(*seen, then);
            write_frame_record(path_of(after.number), after);
            taker_(after, {});
        });
}

/// What its workers said of it, the end where that is much.
std::string ServerFrames::log_of(const Job& job, int frame)
{
    constexpr std::size_t kMost = 16 << 10;
    v1::Request request;
    request.mutable_logs()->set_job(job.number);
    request.mutable_logs()->set_frame(frame);
    const v1::Response reply = asking_->call(request);
    const std::string& text = reply.logs().text();
    return utf8_text(text.substr(text.size() - std::min(text.size(), kMost)));
}

/// @param is_lost  the server has no pictures of it that are still to come
void ServerFrames::end(FrameRecord& frame, const Failure& failure, bool is_lost) const
{
    std::error_code ignored;
    if (failure.why.empty() || is_lost) fs::remove(job_path(path_of(frame.number)), ignored);
    taker_(frame, failure);
}

/// A signal has come. What they have made until then is there for the next run.
void ServerFrames::cancel(const std::vector<Job>& jobs) const
{
    try {
        for (const Job& job : jobs) connect(arguments_.server, Patience::none_and_no_interrupt).cancel(job.number);
    } catch (const ServiceError& e) {
        bar_.log()(LogLevel::warning, std::string("the server goes on with the frames that wait there: ") + e.what());
    }
}

}  // namespace rcs::service
