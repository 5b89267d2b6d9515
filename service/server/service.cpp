// What Service does for frames and files; requests.cpp answers clients.
#include "server/service.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/check_job.h"
#include "server/sockets.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kTendPeriod = 250, kExpiryPeriod = 60'000, kRetryUnsaved = 500;  // [ms]
constexpr double kGiga = 1e9;

std::string prepared_state(const std::string& folder)
{
    std::error_code problem;
    fs::create_directories(fs::path(folder).parent_path(), problem);
    make_private_folder(folder);
    make_private_folder(folder + "/results");
    return folder;
}

Fd locked(const std::string& state)
{
    Fd lock(::open((prepared_state(state) + "/lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600));
    if (!lock) fail_file("open", state + "/lock");
    if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
        throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "another server uses the state folder " + state);
    }
    return lock;
}

}  // namespace

Service::Service(const ServerConfig& config, const ServerLog& log)
    : config_(config),
      log_(log),
      lock_(locked(config.state)),
      queue_(config.state + "/queue.db", config.queue, now_ms()),
      blobs_(config.state, config.blobs),
      workers_(config, log),
      started_ms_(now_ms())
{
    remove_orphans();
}

void Service::adopt_config()
{
    queue_.set_options(config_.queue);
    blobs_.set_limits(config_.blobs);
}

/// Pictures of frames that did not end before an earlier server did.
void Service::remove_orphans()
{
    const std::set<std::string> used = queue_.folders_in_use();
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(config_.state + "/results", ignored)) {
        if (!used.contains("results/" + entry.path().filename().string())) fs::remove_all(entry.path(), ignored);
    }
}

void Service::take(std::vector<FrameEnd> ends)
{
    of_this_turn_ = std::move(unsaved_);
    unsaved_.clear();
    for (FrameEnd& end : ends) of_this_turn_.push_back(std::move(end));
    for (const FrameEnd& end : of_this_turn_) put_down(end);
}

void Service::put_down(const FrameEnd& end)
{
    const std::int64_t now = now_ms();
    const FrameKey key = end.frame.key;
    if (end.done) {
        queue_.complete(key,
                        {end.frame.folder,
                         {end.done->files().begin(), end.done->files().end()},
                         end.done->stats_json(),
                         end.frame.warnings,
                         end.done->error_estimate()},
                        now);
    } else {
        queue_.fail(key, end.ending, end.error, now);
    }
}

void Service::commit()
{
    queue_.commit();
    for (const FrameEnd& end : of_this_turn_) {
        const double seconds = 1e-3 * static_cast<double>(now_ms() - end.frame.started_ms);
        if (end.done) {
            ++counters_.frames_completed;
            counters_.frame_seconds += seconds;
            log_.info("frame_completed",
                      {{"job", end.frame.key.job}, {"frame", end.frame.progress.frame()}, {"seconds", seconds}});
        } else {
            std::error_code ignored;
            fs::remove_all(results_path(end.frame.folder), ignored);
            ++(end.ending == Ending::failed ? counters_.frames_failed : counters_.frames_retried);
            log_.write(
                Level::warning, "frame_ended",
                {{"job", end.frame.key.job}, {"frame", end.frame.progress.frame()}, {"why", end.error.message()}});
        }
    }
    of_this_turn_.clear();
}

void Service::roll_back()
{
    queue_.roll_back();
    for (FrameEnd& end : of_this_turn_) unsaved_.push_back(std::move(end));
    of_this_turn_.clear();
}

internal::Task Service::task_of(const NextFrame& next, std::int64_t now)
{
    internal::Task task;
    task.set_id(next_task_++);
    *task.mutable_job() = next.job;
    *task.mutable_frame() = next.frame;
    const v1::Scene& scene = next.job.scene();
    if (scene.has_builtin()) task.set_scene_file(scene.builtin());
    if (scene.has_path()) task.set_scene_file(confined_file(scene.path(), config_.roots));
    if (scene.has_files()) task.set_scene_file(blobs_.scene(next.scene_key, scene.files()));
    task.set_scene_key(next.scene_key);
    if (next.job.environment().has_image()) {
        const auto file =
            single_file("environment" + next.job.environment().image_ending(), next.job.environment().image());
        task.set_environment_file(blobs_.scene(BlobStore::scene_key(file), file));
    }
    if (next.job.tone_map().has_ocio_config()) {
        const auto file = single_file("config.ocio", next.job.tone_map().ocio_config());
        task.set_ocio_file(blobs_.scene(BlobStore::scene_key(file), file));
    }
    const std::string folder = "results/" + std::to_string(next.key.job) + "." + std::to_string(next.key.index) + "." +
                               std::to_string(now) + "." + std::to_string(task.id());
    make_private_folder(results_path(folder));
    task.set_folder(folder);
    return task;
}

bool Service::start_one(std::int64_t now)
{
    const auto next = queue_.next(now);
    if (!next) return false;
    Worker* worker = workers_.idle(next->scene_key);
    if (worker == nullptr) return false;
    internal::ToWorker message;
    try {
        *message.mutable_task() = task_of(*next, now);
    } catch (const ServiceError& e) {
        queue_.start(next->key, now);
        queue_.fail(next->key, e.code() == v1::ERROR_CODE_UNAVAILABLE ? Ending::may_pass : Ending::failed,
                    error_message(e.code(), e.what()), now);
        queue_.commit();
        log_.write(Level::warning, "frame_not_started", {{"job", next->key.job}, {"why", e.what()}});
        return true;
    }
    queue_.start(next->key, now);
    queue_.commit();
    RunningFrame frame;
    frame.key = next->key;
    frame.task = message.task().id();
    frame.folder = message.task().folder();
    frame.started_ms = now;
    const double limit = next->job.time_limit_seconds() > 0.0 ? next->job.time_limit_seconds() : config_.time_limit;
    frame.deadline_ms = now + static_cast<std::int64_t>(1e3 * limit);
    frame.progress.set_frame(next->frame.number());
    worker->scene_key = next->scene_key;
    worker->frame = std::move(frame);
    message.mutable_task()->set_folder(results_path(message.task().folder()));
    workers_.send(*worker, message);
    return true;
}

void Service::schedule()
{
    if (stopping_) return;
    try {
        while (start_one(now_ms())) {
        }
    } catch (const ServiceError& e) {
        queue_.roll_back();
        log_.write(Level::error, "not_scheduled", {{"why", e.what()}});
    }
}

std::int64_t Service::tend()
{
    const std::int64_t now = now_ms();
    if (!stopping_ || !is_idle()) workers_.tend(now, [&](std::uint64_t job) { return queue_.is_cancelled(job); });
    if (now >= next_expiry_ms_) {
        next_expiry_ms_ = now + kExpiryPeriod;
        expire(now);
    }
    std::int64_t next = now + (unsaved_.empty() ? kTendPeriod : kRetryUnsaved);
    if (const auto retry = queue_.next_retry_ms()) next = std::min(next, std::max(now + 1, *retry));
    return next;
}

void Service::expire(std::int64_t now)
{
    const std::int64_t oldest = now - static_cast<std::int64_t>(config_.keep_days * 86'400'000.0);
    try {
        auto jobs = queue_.ended_jobs();
        std::uint64_t bytes = 0;
        for (const auto& job : jobs) bytes += job.bytes;
        std::set<std::string> before = queue_.folders_in_use();
        bool any = false;
        for (const auto& job : jobs) {
            if (job.finished_ms >= oldest && static_cast<double>(bytes) <= config_.keep_gb * kGiga) break;
            queue_.remove(job.job);
            bytes -= std::min(bytes, job.bytes);
            ++counters_.jobs_expired;
            any = true;
        }
        queue_.commit();
        if (any) {
            for (const std::string& kept : queue_.folders_in_use()) before.erase(kept);
            std::error_code ignored;
            for (const std::string& folder : before) fs::remove_all(results_path(folder), ignored);
            log_.info("expired", {{"folders", before.size()}});
        }
        blobs_.remove_unused(oldest, config_.blobs.max_store / 10 * 9, queue_.blobs_in_use(), queue_.scenes_in_use());
    } catch (const ServiceError& e) {
        queue_.roll_back();
        log_.write(Level::error, "not_expired", {{"why", e.what()}});
    }
}

bool Service::is_idle() const
{
    const auto& all = workers_.workers();
    return unsaved_.empty() &&
           std::none_of(all.begin(), all.end(), [](const Worker& w) { return w.frame.has_value(); });
}

void Service::end()
{
    for (const RunningFrame& frame : workers_.stop()) {
        try {
            queue_.give_back(frame.key);
            queue_.commit();
        } catch (const ServiceError& e) {
            queue_.roll_back();  // the next server finds it running, and does the same
        }
        std::error_code ignored;
        fs::remove_all(results_path(frame.folder), ignored);
    }
}

}  // namespace rcs::service
