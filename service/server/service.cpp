// What Service does for frames and files; requests.cpp answers clients.
#include "server/service.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "queue/salvage.h"
#include "server/check_job.h"
#include "server/sockets.h"
#include "wire/errors.h"
#include "wire/framing.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kTendPeriod = 250, kExpiryPeriod = 60'000, kRetryUnsaved = 500,
                       kPauseOfScheduling = 1000;  // [ms]
constexpr double kMega = 1e6, kGiga = 1e9;

std::string prepared_state(const std::string& folder)
{
    std::error_code problem;
    fs::create_directories(fs::path(folder).parent_path(), problem);
    make_private_folder(folder);
    for (const char* within : {kResults, "shaders"}) make_private_folder(folder + "/" + within);
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

/// The state folder; its queue is salvaged first where that is needed and allowed.
std::string whole_state(const ServerConfig& config, const ServerLog& log)
{
    if (!config.recover) return config.state;
    try {
        prepare_queue(config.state, read_clocks());
    } catch (const ServiceError& e) {
        if (e.code() != v1::ERROR_CODE_BAD_FILE) throw;
        log.write(Level::warning, "recovering", {{"why", e.what()}});
        const Salvaged done = salvage_queue(config.state, read_clocks());
        log.write(Level::warning, "recovered",
                  {{"jobs", done.jobs},
                   {"frames", done.frames},
                   {"unreadable", done.lost},
                   {"to_be_rendered_again", done.again},
                   {"next_job", done.numbers + 1},
                   {"old_files", config.state + "/aside"}});
    }
    return config.state;
}

/// Also to another disk.
std::error_code move(const fs::path& from, const fs::path& to)
{
    std::error_code problem, ignored;
    fs::rename(from, to, problem);
    if (problem != std::errc::cross_device_link) return problem;
    fs::copy(from, to, fs::copy_options::recursive, problem);
    fs::remove_all(problem ? to : from, ignored);
    return problem;
}

}  // namespace

Service::Service(const ServerConfig& config, const ServerLog& log)
    : config_(config),
      log_(log),
      lock_(locked(config.state)),
      queue_(whole_state(config, log), config.queue, read_clocks()),
      blobs_(config.state, config.blobs),
      logs_(config.state),
      workers_(config, log),
      completion_command_(config, log),
      started_ms_(steady_ms())
{
    tidy_results();
    if (!config.deliver_root.empty()) deliverer_.emplace(config.deliver_root);
}

void Service::adopt_config()
{
    queue_.set_options(config_.queue);
    blobs_.set_limits(config_.blobs);
    workers_.adopt_config();
}

/// What frames left that ran when an earlier server ended is removed. Pictures that the queue does not know are
/// somebody's: they are moved aside, and go from there when pictures of their age do.
void Service::tidy_results()
{
    std::error_code ignored;
    for (const std::string& folder : queue_.unfinished_folders()) fs::remove_all(path_of(folder), ignored);
    const std::set<std::string> used = queue_.folders_in_use();
    const std::string aside = path_of("aside");
    make_private_folder(aside);
    for (const auto& entry : fs::directory_iterator(path_of(kResults), ignored)) {
        const std::string name = entry.path().filename().string();
        if (used.contains(kResults + ("/" + name))) continue;
        if (name.starts_with(kWorkerHome)) {
            fs::remove_all(entry.path(), ignored);
            continue;
        }
        const std::string to = aside + "/" + name;
        if (const std::error_code problem = move(entry.path(), to)) {
            log_.write(Level::warning, "not_moved_aside", {{"folder", name}, {"why", problem.message()}});
            continue;
        }
        set_modified(to, queue_clock_ms());
        log_.write(Level::warning, "moved_aside", {{"folder", to}, {"why", "the queue knows no frame of it"}});
    }
}

void Service::take(std::vector<FrameEnd> ends)
{
    of_this_turn_ = std::move(unsaved_);
    unsaved_.clear();
    for (FrameEnd& end : ends) of_this_turn_.push_back(std::move(end));
    if (std::any_of(of_this_turn_.begin(), of_this_turn_.end(),
                    [](const FrameEnd& end) { return end.done.has_value(); }))
        sync_path(path_of(kResults));  // where their pictures have come
    for (const FrameEnd& end : of_this_turn_) put_down(end);
}

void Service::put_down(const FrameEnd& end)
{
    const Moment now = read_clocks();
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

std::vector<std::uint64_t> Service::commit()
{
    queue_.commit();
    std::vector<std::uint64_t> ended = queue_.take_changed();
    for (FrameEnd& end : of_this_turn_) {
        ended.push_back(end.frame.key.job);
        const double seconds = 1e-3 * static_cast<double>(steady_ms() - end.frame.started_ms);
        char took[60];
        std::snprintf(took, sizeof took, " after %.2f s", seconds);
        end.frame.log.add((end.done ? "completed" : "ended: " + end.error.message()) + took);
        logs_.append(end.frame.key, end.frame.log.text());
        if (end.done) {
            ++counters_.frames_completed;
            counters_.frame_seconds += seconds;
            log_.info("frame_completed",
                      {{"job", end.frame.key.job}, {"frame", end.frame.progress.frame()}, {"seconds", seconds}});
        } else {
            std::error_code ignored;
            fs::remove_all(end.frame.making, ignored);
            ++(end.ending == Ending::failed ? counters_.frames_failed : counters_.frames_retried);
            log_.write(
                Level::warning, "frame_ended",
                {{"job", end.frame.key.job}, {"frame", end.frame.progress.frame()}, {"why", end.error.message()}});
        }
    }
    of_this_turn_.clear();
    return ended;
}

void Service::roll_back()
{
    queue_.roll_back();
    for (FrameEnd& end : of_this_turn_) unsaved_.push_back(std::move(end));
    of_this_turn_.clear();
}

internal::Task Service::task_of(const NextFrame& next, const std::string& home)
{
    if (!next.job) throw ServiceError(v1::ERROR_CODE_INTERNAL, "what the queue holds of the job is damaged");
    const v1::Job& job = *next.job;
    const std::int64_t clock = queue_clock_ms();
    internal::Task task;
    task.set_id(next_task_++);
    *task.mutable_job() = job;
    *task.mutable_frame() = next.frame;
    const v1::Scene& scene = job.scene();
    if (scene.has_builtin()) task.set_scene_file(scene.builtin());
    if (scene.has_path()) task.set_scene_file(confined_file(scene.path(), config_.roots));
    if (scene.has_files()) {
        task.set_scene_file(blobs_.scene(next.scene_key, scene.files(), clock));
        task.mutable_job()->mutable_scene()->mutable_files()->Clear();  // they lie there; their list may be long
    }
    task.set_scene_key(next.scene_key);
    if (job.environment().has_image()) {
        const auto file = single_file("environment" + job.environment().image_ending(), job.environment().image());
        task.set_environment_file(blobs_.scene(BlobStore::scene_key(file), file, clock));
    }
    if (job.tone_map().has_ocio_config()) {
        const auto file = single_file("config.ocio", job.tone_map().ocio_config());
        task.set_ocio_file(blobs_.scene(BlobStore::scene_key(file), file, clock));
    }
    task.set_folder(home + "/" + std::to_string(next.key.job) + "." + std::to_string(next.key.index) + "." +
                    random_id());
    make_private_folder(task.folder());
    return task;
}

bool Service::start_one(Moment now)
{
    const auto next = queue_.next(now);
    if (!next) return false;
    Worker* worker = workers_.idle(next->scene_key);
    if (worker == nullptr) return false;
    internal::Task task;
    std::string bytes;
    try {
        task = task_of(*next, worker->home);
        internal::ToWorker message;
        *message.mutable_task() = task;
        bytes = service::frame(message);
    } catch (const ServiceError& e) {
        if (e.code() == v1::ERROR_CODE_UNAVAILABLE) throw;
        queue_.start(next->key, "", now);
        queue_.fail(next->key, Ending::failed, error_message(e.code(), e.what()), now);
        queue_.commit();
        log_.write(Level::warning, "frame_not_started", {{"job", next->key.job}, {"why", e.what()}});
        return true;
    }
    RunningFrame frame;
    frame.making = task.folder();
    frame.folder = kResults + ("/" + fs::path(frame.making).filename().string());
    queue_.start(next->key, frame.folder, now);
    queue_.commit();
    frame.key = next->key;
    frame.task = task.id();
    frame.started_ms = now.steady_ms;
    const double limit = next->job->time_limit_seconds() > 0.0 ? next->job->time_limit_seconds() : config_.time_limit;
    frame.deadline_ms = now.steady_ms + static_cast<std::int64_t>(1e3 * limit);
    frame.progress.set_frame(next->frame.number());
    frame.log.add("started, worker " + std::to_string(worker->pid) +
                  (worker->host.empty() ? "" : " on " + worker->host));
    worker->scene_key = next->scene_key;
    worker->frame = std::move(frame);
    workers_.send(*worker, bytes);
    return true;
}

void Service::schedule()
{
    if (stopping_ || !workers_.has_idle() || steady_ms() < schedule_after_ms_) return;
    watch_space();
    if (!pause_.empty()) return;
    try {
        while (workers_.has_idle() && start_one(read_clocks())) {
        }
        not_scheduled_.clear();
    } catch (const ServiceError& e) {
        queue_.roll_back();
        if (not_scheduled_ != e.what()) log_.write(Level::error, "not_scheduled", {{"why", e.what()}});
        not_scheduled_ = e.what();
        schedule_after_ms_ = steady_ms() + kPauseOfScheduling;
    }
}

double Service::free_mb() const
{
    return static_cast<double>(std::min(free_space(config_.state), free_space(path_of(kResults)))) / kMega;
}

std::string Service::reason_to_wait() const
{
    if (workers_.any_waits_for_space()) return "a finished picture waits for room on the server's disk";
    const double free = free_mb(), least = 0.5 * config_.min_free_mb;
    if (free >= least) return {};
    char text[160];
    std::snprintf(text, sizeof text, "the server's disk is full: %.0f MB are free, frames wait until %.0f MB are", free,
                  least);
    return text;
}

/// Says in the log when frames begin to wait for room, and when they no longer do.
void Service::watch_space()
{
    std::string why = reason_to_wait();
    if (why.empty() && !pause_.empty()) log_.info("resumed", {{"why", "there is room on the disk again"}});
    if (!why.empty() && pause_.empty()) log_.write(Level::warning, "paused", {{"why", why}});
    pause_ = std::move(why);
}

/// Those of this machine cost nothing while they wait. Of Slurm's as many as there is work for.
std::size_t Service::workers_wanted(Moment now)
{
    const auto most = static_cast<std::uint64_t>(config_.workers);
    if (config_.engine == WorkerEngine::local) return most;
    const std::uint64_t run = queue_.count(v1::FRAME_STATE_ACTIVE);
    const bool waits = !stopping_ && queue_.next(now).has_value();
    return std::min(
        most, run + (waits ? queue_.count(v1::FRAME_STATE_QUEUED) + queue_.count(v1::FRAME_STATE_SOFT_FAILED) : 0));
}

std::int64_t Service::tend()
{
    const Moment moment = read_clocks();
    const std::int64_t now = moment.steady_ms;
    watch_space();
    deliver(now);
    announce(now);
    if (!stopping_ || frames_run())
        workers_.tend(now, workers_wanted(moment), [&](std::uint64_t job) { return queue_.is_cancelled(job); });
    if (now >= next_expiry_ms_) {
        next_expiry_ms_ = now + kExpiryPeriod;
        expire(moment);
    }
    std::int64_t next = now + (unsaved_.empty() ? kTendPeriod : kRetryUnsaved);
    next = std::max(now + 1, std::min(next, workers_.next_deadline_ms()));
    if (const auto retry = queue_.next_retry_ms()) next = std::min(next, std::max(now + 1, *retry));
    return next;
}

/// Ages are by the queue's clock: setting the wall's makes nothing old.
void Service::expire(Moment now)
{
    const std::int64_t oldest = queue_.clock_ms(now) - static_cast<std::int64_t>(config_.keep_days * 86'400'000.0);
    try {
        queue_.keep_clock(now);
        queue_.commit();
        expire_jobs(oldest);
        blobs_.remove_unused(oldest, config_.blobs.max_store / 10 * 9, queue_.blobs_in_use(), queue_.scenes_in_use());
        BlobStore::remove_older(path_of("aside"), oldest);
    } catch (const ServiceError& e) {
        queue_.roll_back();
        log_.write(Level::error, "not_expired", {{"why", e.what()}});
    }
}

void Service::expire_jobs(std::int64_t oldest_ms)
{
    auto jobs = queue_.ended_jobs();
    std::uint64_t bytes = 0;
    for (const auto& job : jobs) bytes += job.bytes;
    std::vector<std::string> folders;
    std::vector<std::uint64_t> removed;
    for (const auto& job : jobs) {
        if (job.ended_ms >= oldest_ms && static_cast<double>(bytes) <= config_.keep_gb * kGiga) break;
        for (std::string& folder : queue_.folders_of(job.job)) folders.push_back(std::move(folder));
        queue_.remove(job.job);
        bytes -= std::min(bytes, job.bytes);
        removed.push_back(job.job);
    }
    queue_.commit();
    if (removed.empty()) return;
    counters_.jobs_expired += removed.size();
    std::error_code ignored;
    for (const std::string& folder : folders) fs::remove_all(path_of(folder), ignored);
    for (const std::uint64_t job : removed) logs_.remove(job);
    log_.info("expired", {{"jobs", removed.size()}, {"folders", folders.size()}});
}

bool Service::is_idle() const { return !frames_run() && completion_command_.is_idle(); }

bool Service::frames_run() const
{
    const auto& all = workers_.workers();
    return !unsaved_.empty() ||
           std::any_of(all.begin(), all.end(), [](const Worker& w) { return w.frame.has_value(); });
}

void Service::end()
{
    for (RunningFrame& frame : workers_.stop()) {
        frame.log.add("given back to the queue: the server stops");
        logs_.append(frame.key, frame.log.text());
        try {
            queue_.give_back(frame.key, read_clocks());
            queue_.commit();
        } catch (const ServiceError& e) {
            queue_.roll_back();  // the next server finds it running, and does the same
        }
    }
}

}  // namespace rcs::service
