#include "cli/batch_frame.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "cli/batch_settings.h"
#include "cli/outputs.h"
#include "cli/run_support.h"
#include "cli/running_mark.h"
#include "output/small_copy.h"
#include "output/stats_json.h"
#include "process/clock.h"
#include "rcs/rcs.h"
#include "report/encoding.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kThumbnailSide = 160;  ///< [px]

/// A failure that the same frame may not meet again.
bool may_pass(ErrorCode code)
{
    return code == ErrorCode::io || code == ErrorCode::out_of_memory || code == ErrorCode::gl_unavailable ||
           code == ErrorCode::internal;
}

SessionOptions session_options(const BatchArguments& arguments, bool is_animated, LogFunction log)
{
    return {.threads = arguments.render.scene.threads,
            .keep_records = keeps_records(arguments, is_animated),
            .watch_records = is_animated,
            .log = std::move(log)};
}

RenderOptions batch_options(const BatchArguments& arguments)
{
    RenderOptions options = final_options(arguments.render);
    if (arguments.deadline_ms) options.quality = TargetError{};
    return options;
}

void prepare_folder(const fs::path& folder)
{
    std::error_code failed;
    if (!folder.empty()) fs::create_directories(folder, failed);
    if (failed) throw Error(ErrorCode::io, folder.string() + ": cannot be made: " + failed.message());
}

/// Parsed once folders are there, so that outputs can be checked before any work.
std::vector<OutputFile> prepared_outputs(const BatchArguments& arguments, const std::vector<int>& frames)
{
    std::vector<OutputFile> files = parse_outputs(arguments.render.output, PixelFormat::half_float);
    for (const OutputFile& file : files) {
        if (frames.size() > 1 && !has_frame_pattern(file.path))
            throw Error(ErrorCode::bad_argument,
                        "--output " + file.path + " needs a #### for the frame's number, as there are several frames");
    }
    for (const OutputFile& file : files) prepare_folder(fs::path(file.path).parent_path());
    return files;
}

}  // namespace

FrameMaker::FrameMaker(const BatchArguments& arguments, ProgressBar& bar, std::function<void()> on_request)
    : arguments_(arguments),
      bar_(bar),
      on_request_(std::move(on_request)),
      options_(batch_options(arguments)),
      numbers_(parse_frames(arguments.frames)),
      files_(prepared_outputs(arguments, numbers_)),
      outputs_(output_files(files_, parse_tone_map(arguments.render.output), log(), true)),
      scene_(arguments.render.scene),
      session_(session_options(arguments, scene_.is_animated(), bar.log())),
      shared_records_(arguments.records_file, arguments.task.kind),
      settings_(settings_of_frames(arguments, scene_.is_animated(), options_, files_, outputs_.tone_mapper())),
      ahead_(arguments, scene_.is_animated(), numbers_),
      quality_(options_.quality)
{
    prepare_folder(fs::path(record_path(files_.front().path)).parent_path());
}

FrameRecord FrameMaker::wanted(int number) const
{
    FrameRecord wanted;
    wanted.number = number;
    const double time = time_of(number);
    wanted.source = scene_.source_at(time);
    if (arguments_.shutter.blurs())
        for (const double part : {0.0, 1.0})
            wanted.source += " " + scene_.source_at(arguments_.shutter.exposed(time).at(part));
    wanted.depends = {{"scene", ""}, {"camera", ""}};
    wanted.depends.insert(wanted.depends.end(), settings_.begin(), settings_.end());
    const std::string exposure = arguments_.render.output.exposure;
    const bool held = held_exposure_ && number != exposure_frame_;
    if (!std::all_of(files_.begin(), files_.end(), is_exr))
        wanted.depends.emplace_back("exposure", held ? "held at " + number_text(*held_exposure_) : exposure);
    const std::vector<std::string> paths = paths_of(number);
    const fs::path folder = fs::path(paths.front()).parent_path();
    for (std::size_t i = 0; i < files_.size(); ++i)
        wanted.files.push_back({fs::path(paths[i]).lexically_proximate(folder).string(), 0, kept_by(files_[i]), {}});
    return wanted;
}

void FrameMaker::forget(const FrameRecord& frame) const
{
    const std::string path = record_path(paths_of(frame.number).front());
    std::error_code ignored;
    fs::remove(path, ignored);
    fs::remove(failed_path(path), ignored);
}

void FrameMaker::settle(FrameRecord& frame) const
{
    const std::string first = paths_of(frame.number).front();
    for (FrameFile& file : frame.files) {
        const std::string path = (fs::path(first).parent_path() / file.name).string();
        file.bytes = fs::file_size(path);
        file.hash = file_hash(path);
    }
    write_frame_record(record_path(first), frame);
}

void FrameMaker::render(FrameRecord& wanted)
{
    const std::string path = record_path(paths_of(wanted.number).front());
    const RunningMark mark(running_path(path));
    forget(wanted);
    for (int tries = 1;; ++tries) {
        try {
            wanted.figures = {};
            wanted.figures.tries = tries;
            try_frame(wanted);
            return settle(wanted);
        } catch (const Error& e) {
            if (e.code() == ErrorCode::cancelled && interrupt_signal() == 0)
                throw Error(ErrorCode::internal,
                            "it took longer than --time-limit " + number_text(arguments_.time_limit) + " s");
            if (tries > arguments_.retries || !may_pass(e.code())) throw;
            log()(LogLevel::info, "frame " + std::to_string(wanted.number) + " is tried again: " + e.what());
        }
    }
}

std::vector<std::string> FrameMaker::paths_of(int number) const
{
    std::vector<std::string> paths;
    for (const OutputFile& file : files_) paths.push_back(path_of_frame(file.path, number));
    return paths;
}

LogFunction FrameMaker::log()
{
    return [this, show = bar_.log()](LogLevel level, std::string_view line) {
        // What a deadline aims at is a guess that nobody asked for: what was reached is in the report.
        const bool is_guess = arguments_.deadline_ms && line.ends_with(" wanted");
        if (level == LogLevel::warning && !is_guess) warnings_.emplace_back(line);
        say(line);
        show(is_guess ? LogLevel::info : level, line);
    };
}

void FrameMaker::say(std::string_view line)
{
    constexpr std::size_t kMostLines = 100;
    if (said_.size() == kMostLines) said_.pop_front();
    said_.emplace_back(line);
}

std::string FrameMaker::log_so_far() const
{
    std::string text;
    for (const std::string& line : said_) text += line + "\n";
    return text;
}

ProgressFunction FrameMaker::progress()
{
    return [this, show = bar_.progress()](std::string_view stage, float fraction) {
        if (std::this_thread::get_id() == main_) {
            answer_request();
            if (stage_ != stage) say("stage: " + (stage_ = stage));
        }
        too_slow_ = arguments_.time_limit > 0.0 && seconds_since(frame_began_) > arguments_.time_limit;
        return show(stage, fraction) && !too_slow_ && !(latest_ && Clock::now() > *latest_);
    };
}

/// Hashes of scene and camera, of what the session shows.
void FrameMaker::identify(FrameRecord& wanted)
{
    Fingerprint scene, camera;
    const auto add_moment = [&](double time) {
        scene_.show(session_, time, log());
        add(scene, session_.scene());
        add(camera, choose_camera(session_.scene(), scene_.camera_at(time)));
    };
    const double time = time_of(wanted.number);
    if (arguments_.shutter.blurs())
        for (const double part : {0.0, 1.0}) add_moment(arguments_.shutter.exposed(time).at(part));
    add_moment(time);
    for (auto& [name, text] : wanted.depends) {
        if (name == "scene") text = scene.text();
        if (name == "camera") text = camera.text();
    }
}

void FrameMaker::hold_exposure(const FrameFigures& figures)
{
    if (!finds_exposure()) return;
    held_exposure_ = static_cast<float>(figures.exposure);
    outputs_.tone_mapper()->hold_exposure(held_exposure_);
}

bool FrameMaker::shows_as_held(const FrameRecord& frame) const
{
    const auto found =
        std::find(frame.depends.begin(), frame.depends.end(), std::pair<std::string, std::string>("exposure", "auto"));
    return held_exposure_ && found != frame.depends.end() &&
           static_cast<float>(frame.figures.exposure) == *held_exposure_;
}

Forecast FrameMaker::forecast(int number)
{
    FrameRecord frame = wanted(number);
    identify(frame);
    session_.gl();  // what is made once is no frame's time
    session_.rays(options_.effects);
    const Camera camera = choose_camera(session_.scene(), scene_.camera_at(time_of(number)));
    RenderOptions options = options_;
    options.quality = TargetError{};
    options.layers.emplace();  // they are no matter of time
    return rcs::forecast(session_, camera, options, {.log = bar_.log(), .progress = progress()}).forecast;
}

void FrameMaker::take_exposure(const std::vector<int>& all)
{
    for (const int number : all) {
        if (!finds_exposure()) return;
        const auto record = read_frame_record(record_path(paths_of(number).front()));
        if (!record) continue;
        FrameRecord is = wanted(number);
        for (std::size_t i = 0; i < 2; ++i) is.depends[i].second = record->depends[i].second;  // its source is the same
        if (record->source != is.source || record->depends != is.depends) continue;
        exposure_frame_ = number;
        hold_exposure(record->figures);
    }
}

/// Those of a file, in the scene that they were gathered in: an overture's last frame, or one like this.
void FrameMaker::begin_records(int number)
{
    if (!shared_records_.are_wanted()) return;
    std::vector<int> frames;
    if (scene_.is_animated() && arguments_.task.kind == TaskKind::part)
        frames = frames_of({TaskKind::overture, 1, arguments_.task.parts}, numbers_);
    else if (scene_.is_animated() && arguments_.task.kind == TaskKind::all)
        frames = {numbers_.back()};
    std::reverse(frames.begin(), frames.end());
    frames.push_back(number);
    for (const int frame : frames) {
        scene_.show(session_, time_of(frame), log());
        const bool found =
            shared_records_.begin(session_, options_, scene_.is_animated(), &frame == &frames.back(), log());
        if (!found) continue;
        const Camera camera = choose_camera(session_.scene(), scene_.camera_at(time_of(frame)));
        if (scene_.is_animated()) begin_watching(session_, camera, options_, {.log = log(), .progress = progress()});
        return;
    }
}

/// What serves all frames around this one is not its time, nor limited by what that may be.
AheadStats FrameMaker::look_ahead(int number, const Quality& quality)
{
    const auto since = Clock::now() - frame_began_;
    const double cpu = cpu_seconds();
    frame_began_ = Clock::time_point::max();
    const auto camera_of = [&](int n) { return scene_.camera(session_, time_of(n), {}); };
    const auto killed = [&](int n) {
        const int own = n == number ? 1 : 0;
        return starts_without_end(running_path(record_path(paths_of(n).front()))) > own;
    };
    RenderOptions options = options_;
    options.quality = quality;
    const AheadStats ahead =
        ahead_.look(session_, number, options, camera_of, killed, {.log = log(), .progress = progress()});
    frame_began_ = Clock::now() - since;
    cpu_began_ += cpu_seconds() - cpu;
    return ahead;
}

std::optional<AheadStats> FrameMaker::place_ahead(int number, const Quality& quality, double seconds)
{
    FrameRecord frame = wanted(number);
    identify(frame);
    if (places_for(number).empty()) ahead_.look_again();
    const auto latest =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    latest_ = latest;
    std::optional<AheadStats> ahead;
    try {
        ahead = look_ahead(number, quality);
        latest_.reset();
    } catch (const Error& e) {
        latest_.reset();
        if (e.code() != ErrorCode::cancelled || interrupt_signal() != 0 || Clock::now() < latest) throw;
    }
    return ahead;
}

RenderResult FrameMaker::render_picture(FrameRecord& wanted)
{
    begin_records(wanted.number);
    identify(wanted);
    look_ahead(wanted.number, quality_);
    wanted.figures.records_reused = session_.records().size();
    RenderArguments arguments = arguments_.render;
    arguments.scene.time = time_of(wanted.number);
    RenderOptions options = options_;
    options.quality = quality_;
    options.motion = motion_from(arguments, session_.scene());
    const Camera camera = choose_camera(session_.scene(), scene_.camera_at(time_of(wanted.number)));
    const RenderHooks hooks{.log = log(), .progress = progress()};
    RenderResult result =
        arguments_.shutter.blurs()
            ? rcs::render(session_, scene_.moments(session_, arguments_.shutter, *arguments.scene.time), options, hooks)
            : rcs::render(session_, camera, options, hooks);
    result.image.metadata["rcs:scene"] = arguments.scene.scene;
    result.image.metadata["rcs:environment"] = arguments.scene.environment;
    return result;
}

void FrameMaker::try_frame(FrameRecord& wanted)
{
    frame_began_ = Clock::now();
    cpu_began_ = cpu_seconds();
    warnings_.clear();
    const RenderResult result = render_picture(wanted);
    forecast_ = result.stats.forecast;
    const double rendered = seconds_since(frame_began_);
    RunReport written;
    outputs_.write(result.image, session_.pool(), progress(), written,
                   [&](const std::string& pattern) { return path_of_frame(pattern, wanted.number); });

    FrameFigures& figures = wanted.figures;
    const RenderStats& stats = result.stats;
    figures.error = stats.errors.image.mean_relative;
    figures.indirect_error = stats.errors.indirect.mean_relative;
    figures.records_made = stats.records.records + stats.records.renewed;
    figures.rays = all_rays(stats);
    judge(wanted, result.image, figures);
    const Image& beauty = result.image.layers.at("beauty");
    figures.exposure = static_cast<double>(outputs_.tone_mapper()->exposure(beauty));
    const Image small = outputs_.tone_mapper()->apply(small_copy(beauty, kThumbnailSide), session_.pool());
    figures.thumbnail = base64(jpeg_bytes(small));
    figures.warnings = warnings_;
    figures.seconds = seconds_since(frame_began_);
    figures.cpu_seconds = cpu_seconds() - cpu_began_;
    seconds_around_ = figures.seconds - rendered;
}

/// How much differs from the frame before: where the camera stands, or the layer `motion` says what moved.
void FrameMaker::judge(const FrameRecord& wanted, const LayeredImage& image, FrameFigures& figures)
{
    Before now{wanted.number, wanted.depends[1].second, flicker_frame(image, "beauty")};
    const auto here = std::lower_bound(numbers_.begin(), numbers_.end(), wanted.number);
    const bool follows = before_ && here != numbers_.begin() && *std::prev(here) == before_->number;
    if (follows && (now.frame.motion || now.camera == before_->camera))
        figures.flicker = change_between(before_->frame, now.frame);
    before_ = std::move(now);
}

}  // namespace rcs::service
