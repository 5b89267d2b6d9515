#include "worker/worker.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "output/moments.h"
#include "output/output_files.h"
#include "output/plan_json.h"
#include "output/stats_json.h"
#include "process/clock.h"
#include "process/process.h"
#include "rcs/rcs.h"
#include "wire/errors.h"
#include "wire/files.h"
#include "wire/framing.h"
#include "wire/options.h"
#include "wire/outputs.h"
#include "wire/scene.h"
#include "wire/sha256.h"
#include "worker/elsewhere.h"
#include "worker/frame_progress.h"
#include "worker/server_link.h"
#include "worker/small_picture.h"
#include "worker/task.h"
#include "worker/worker_seal.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr auto kBetweenPreviews = std::chrono::milliseconds(500);
constexpr auto kBetweenLooks = std::chrono::milliseconds(250);  ///< for room on the disk

/// What files of a picture take at most [bytes].
std::uint64_t most_bytes(const LayeredImage& image, int files)
{
    std::uint64_t floats = 0;
    for (const auto& [name, layer] : image.layers) floats += layer.pixels.size();
    return (1 << 20) + static_cast<std::uint64_t>(files) * floats * sizeof(float);
}

class FrameRenderer {
public:
    FrameRenderer(ServerLink& link, const Seal& seal, int threads)
        : link_(link), seal_(seal), session_({.threads = threads})
    {
        limit_gl_threads(session_.pool().size());
    }

    void prepare();
    void run(const internal::Task& task);

private:
    internal::Done render_frame(const internal::Task& task);
    RunReport begin_report(const v1::Job& job, const RenderOptions& options);
    void make_pictures(const internal::Task& task, RenderOptions options, const OutputFiles& outputs, RunReport& report,
                       internal::Done& done);
    RenderResult render_exposed(const internal::Task& task, const Camera& camera, const RenderOptions& options,
                                const RenderHooks& hooks);
    void show_scene(const internal::Task& task, const EffectChoice& effects, RunReport& report, internal::Done& done);
    LogFunction warnings();
    void tell(FrameProgress& progress);
    void send_preview(const Image& beauty);
    std::vector<v1::OutputFile> settle(const internal::Task& task);
    std::vector<v1::OutputFile> write_pictures(const internal::Task& task, const LayeredImage& image,
                                               const OutputFiles& outputs, const ProgressFunction& progress,
                                               RunReport& report);
    void wait_for_room(std::uint64_t bytes);
    v1::Error failure(v1::ErrorCode code, const char* what, const internal::Task& task) const;
    void send(internal::FromWorker& message);

    ServerLink& link_;
    Seal seal_;
    Session session_;                     // what stays warm from frame to frame
    std::string scene_key_, scene_file_;  // of what it shows
    std::unique_ptr<ToneMapper> preview_mapper_;
    std::uint64_t task_ = 0;
    std::string folder_;
    Clock::time_point previewed_;
};

void FrameRenderer::send(internal::FromWorker& message)
{
    message.set_task(task_);
    link_.send(message);
}

void FrameRenderer::prepare()
{
    const auto begin = Clock::now();
    preview_mapper_ = std::make_unique<ToneMapper>(ToneMapOptions{});
    internal::FromWorker message;
    message.mutable_ready()->set_gl_renderer(utf8_text(session_.gl().renderer()));
    message.mutable_ready()->set_seal(describe(seal_));
    message.mutable_ready()->set_sealed(seal_.is_whole());
    message.mutable_ready()->set_started_after_ms(1e3 * seconds_since(begin));
    send(message);
}

void FrameRenderer::run(const internal::Task& task)
{
    task_ = task.id();
    folder_ = task.folder();
    internal::FromWorker message;
    try {
        *message.mutable_done() = render_frame(task);
        if (message.ByteSizeLong() > kMaxMessage - 64) message.mutable_done()->set_stats_json("{}");
    } catch (const Error& e) {
        *message.mutable_failed() = failure(to_wire(e.code()), e.what(), task);
    } catch (const ServiceError& e) {
        *message.mutable_failed() = failure(e.code(), e.what(), task);
    } catch (const std::bad_alloc&) {
        *message.mutable_failed() = error_message(v1::ERROR_CODE_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& e) {
        *message.mutable_failed() = error_message(v1::ERROR_CODE_INTERNAL, std::string("internal error: ") + e.what());
    }
    send(message);
}

/// Unavailable where the disk is what failed.
v1::Error FrameRenderer::failure(v1::ErrorCode code, const char* what, const internal::Task& task) const
{
    const std::string text = in_the_users_words(what, task);
    const bool full = code == v1::ERROR_CODE_IO && !has_room(folder_, 1 << 20);
    return full ? error_message(v1::ERROR_CODE_UNAVAILABLE, "the server's disk is full: " + text)
                : error_message(code, text);
}

/// To the server; what is less than a warning is for the frame's log.
LogFunction FrameRenderer::warnings()
{
    return [this](LogLevel level, std::string_view line) {
        internal::FromWorker message;
        constexpr std::size_t kLongest = 4000;  // [bytes]
        const std::string text = utf8_text(std::string(line.substr(0, kLongest)));
        level < LogLevel::warning ? message.set_log(text) : message.set_warning(text);
        send(message);
    };
}

void FrameRenderer::tell(FrameProgress& progress)
{
    if (!progress.due()) return;
    internal::FromWorker message;
    *message.mutable_progress() = progress.message();
    send(message);
}

/// Nothing is loaded where the last frame's scene is this one's.
void FrameRenderer::show_scene(const internal::Task& task, const EffectChoice& effects, RunReport& report,
                               internal::Done& done)
{
    const std::string key = key_of(task);
    const auto begin = Clock::now();
    const bool is_shown = session_.has_scene() && scene_key_ == key;
    if (!is_shown) {
        scene_key_.clear();
        if (scene_file_ != task.scene_file()) session_.clear();
        session_.show(timed(report, "load", [&] {
            return load_scene(scene_choice(task), warnings(), session_.has_scene() ? &session_.scene() : nullptr);
        }));
        scene_key_ = key;
        scene_file_ = task.scene_file();
    }
    timed(report, "bvh", [&] { session_.rays(effects); });
    if (!is_shown) done.set_load_seconds(seconds_since(begin));
}

void FrameRenderer::send_preview(const Image& beauty)
{
    const std::string file = folder_ + "/.preview.jpg";
    previewed_ = Clock::now();
    if (!write_small_picture(file, beauty, *preview_mapper_, session_.pool())) return;
    internal::FromWorker message;
    message.mutable_preview()->set_jpeg(read_part(file, 0, 512 << 10));
    ::unlink(file.c_str());
    send(message);
}

/// What was written stays when the power goes; nothing is said to be done before.
std::vector<v1::OutputFile> FrameRenderer::settle(const internal::Task& task)
{
    std::vector<v1::OutputFile> files;
    for (const v1::Output& output : task.job().outputs()) {
        const std::string path = task.folder() + "/" + output.name();
        const FileDigest digest = sha256_of_file(path);
        sync_path(path);
        v1::OutputFile file;
        file.set_name(output.name());
        file.set_size(digest.size);
        file.set_sha256(digest.digest);
        files.push_back(file);
    }
    sync_path(task.folder());
    sync_path(fs::path(task.folder()).parent_path().string());
    return files;
}

/// Returns when the disk has room again, or the frame was cancelled. Says at each look that it is alive.
void FrameRenderer::wait_for_room(std::uint64_t bytes)
{
    internal::FromWorker message;
    message.set_waits_for_space(true);
    do {
        send(message);
        std::this_thread::sleep_for(kBetweenLooks);
    } while (!link_.cancelled() && !has_room(folder_, bytes));
    message.set_waits_for_space(false);
    send(message);
}

/// A picture that is rendered is not lost to a full disk: it is written once there is room.
std::vector<v1::OutputFile> FrameRenderer::write_pictures(const internal::Task& task, const LayeredImage& image,
                                                          const OutputFiles& outputs, const ProgressFunction& progress,
                                                          RunReport& report)
{
    write_small_picture(folder_ + "/" + kThumbnail, image.layers.at("beauty"), *outputs.tone_mapper(), session_.pool());
    const std::uint64_t bytes = most_bytes(image, task.job().outputs_size());
    for (;;) {
        try {
            report.written.clear();
            outputs.write(image, session_.pool(), progress, report);
            return settle(task);
        } catch (const Error& e) {
            if (e.code() != ErrorCode::io || link_.cancelled() || has_room(folder_, bytes)) throw;
        } catch (const ServiceError& e) {
            if (e.code() != v1::ERROR_CODE_UNAVAILABLE || link_.cancelled()) throw;
        }
        wait_for_room(bytes);
    }
}

RunReport FrameRenderer::begin_report(const v1::Job& job, const RenderOptions& options)
{
    RunReport report;
    report.command = "render";
    report.options = list_options(options);
    report.scene = job.scene().label();
    report.threads = session_.pool().size();
    report.cpu_before = cpu_seconds();
    report.width = options.width;
    report.height = options.height;
    return report;
}

/// @param camera  of a picture without motion blur
RenderResult FrameRenderer::render_exposed(const internal::Task& task, const Camera& camera,
                                           const RenderOptions& options, const RenderHooks& hooks)
{
    const double open = task.job().shutter_seconds();
    if (open <= 0.0) return render(session_, camera, options, hooks);
    scene_key_.clear();  // the scene of the last moment stays
    const auto camera_then = [&](double time) { return camera_choice(task.frame(), task.job().camera_path(), time); };
    return render(session_, moments_of(scene_choice(task), camera_then, session_, {open, task.frame().time()}), options,
                  hooks);
}

/// Renders and writes the frame's files.
void FrameRenderer::make_pictures(const internal::Task& task, RenderOptions options, const OutputFiles& outputs,
                                  RunReport& report, internal::Done& done)
{
    FrameProgress progress(task.frame().number(), options.aa);
    RenderHooks hooks;
    hooks.log = warnings();
    hooks.progress = [&](std::string_view stage, float fraction) {
        progress.show(stage, fraction);
        tell(progress);
        return !link_.cancelled();
    };
    hooks.forecast = [&](const Forecast& f) {
        report.forecast = f;
        progress.forecast(f.goal_seconds, f.passes);
    };
    hooks.after_pass = [&](int passes_done, int passes, const std::function<LayeredImage()>& picture) {
        if (Clock::now() - previewed_ < kBetweenPreviews) return;
        const LayeredImage so_far = picture();
        progress.after_pass(passes_done, passes, estimate_errors(so_far).indirect.mean_relative);
        send_preview(so_far.layers.at("beauty"));
    };
    hooks.progress("load", 0.0f);
    show_scene(task, options.effects, report, done);
    const Camera camera = choose_camera(session_.scene(), camera_choice(task.frame(), task.job().camera_path()));
    report.camera = camera.name;
    options.motion = motion_from(task, session_.scene());
    previewed_ = Clock::now();
    RenderResult result = render_exposed(task, camera, options, hooks);
    for (const auto& [stage, seconds] : result.stats.stage_seconds) report.add(stage, seconds);
    result.image.metadata["rcs:scene"] = task.job().scene().label();
    result.image.metadata["rcs:environment"] = task.job().environment().label();
    for (v1::OutputFile& file : write_pictures(task, result.image, outputs, hooks.progress, report))
        *done.add_files() = std::move(file);
    report.render = std::move(result.stats);
}

internal::Done FrameRenderer::render_frame(const internal::Task& task)
{
    const auto begin = Clock::now();
    const v1::Job& job = task.job();
    RenderOptions options = from_message(job.options());
    ToneMapOptions tone_map = from_message(job.tone_map());
    tone_map.ocio_config = task.ocio_file();
    tone_map.one_file_only = true;  // whoever sent it may not read this machine's files by it
    std::vector<OutputFile> files;
    for (const v1::Output& output : job.outputs()) {
        files.push_back(from_message(output));
        files.back().path = task.folder() + "/" + output.name();
    }
    render_for(files, options);

    internal::Done done;
    RunReport report = begin_report(job, options);
    make_pictures(task, options, OutputFiles(files, tone_map, warnings(), true), report, done);
    report.seconds = seconds_since(begin);
    report.written.clear();
    for (const v1::Output& output : job.outputs()) report.written.push_back(output.name());
    done.set_error_estimate(report.render->errors.indirect.mean_relative);
    done.set_stats_json(to_json(report).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    return done;
}

}  // namespace

void run_worker(const WorkerArguments& arguments)
{
    ::unsetenv("OCIO");  // the job says which configuration, or none
    ::setenv("TMPDIR", arguments.home.c_str(), 1);
    ::umask(0077);
    if (arguments.elsewhere) check_is_shared(arguments.state, arguments.home);
    const Seal seal = seal_worker(arguments);
    ServerLink link(arguments.in, arguments.out);
    if (arguments.elsewhere) tell_of_this_process(link);
    FrameRenderer renderer(link, seal, arguments.threads > 0 ? arguments.threads : threads_by_slurm());
    renderer.prepare();
    for (;;) {
        renderer.run(link.next_task());
        give_back_freed_memory();
    }
}

}  // namespace rcs::service
