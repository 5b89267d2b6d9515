#include "server/service.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <set>
#include <sstream>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "rcs/error.h"
#include "rcs/version.h"
#include "server/check_job.h"
#include "server/sockets.h"
#include "wire/errors.h"
#include "wire/framing.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kTendPeriod = 250, kExpiryPeriod = 60'000, kRetryUnsaved = 500;  // [ms]
constexpr double kMega = 1e6, kGiga = 1e9;

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

v1::Response Service::answer(const v1::Request& request, const Caller& caller)
{
    ++counters_.requests;
    v1::Response response;
    response.set_id(request.id());
    try {
        switch (request.call_case()) {
            case v1::Request::kBlobStatus:
                for (const v1::Blob& blob : request.blob_status().blobs()) {
                    response.mutable_blob_status()->add_held(blobs_.held(blob, caller.owner));
                }
                response.mutable_blob_status();
                break;
            case v1::Request::kBlobPut: {
                const v1::BlobPutRequest& put = request.blob_put();
                if (put.data().size() > kMaxChunk)
                    throw ServiceError(v1::ERROR_CODE_LIMIT, "a chunk is larger than max_chunk_bytes");
                if (stopping_) throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "the server is stopping");
                check_space();
                response.mutable_blob_put()->set_held(blobs_.put(put.blob(), caller.owner, put.offset(), put.data()));
                break;
            }
            case v1::Request::kSubmit:
                *response.mutable_submit() = submit(request.submit(), caller);
                break;
            case v1::Request::kFetch:
                *response.mutable_fetch() = fetch(request.fetch(), caller);
                break;
            case v1::Request::kCancel:
                check_may_see(request.cancel().job(), caller);
                response.mutable_cancel()->set_state(*queue_.cancel(request.cancel().job(), now_ms()));
                log_.info("job_cancelled", {{"job", request.cancel().job()}, {"by", caller.owner}});
                break;
            case v1::Request::kList:
                if (request.list().limit() > 1000)
                    throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT, "limit is above 1000");
                *response.mutable_list() = queue_.list(request.list(), caller.sees_all ? "" : caller.owner);
                break;
            case v1::Request::kJob:
                if (request.job().frames() > 500)
                    throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT, "frames is above 500");
                check_may_see(request.job().job(), caller);
                *response.mutable_job() = queue_.details(request.job());
                *response.mutable_job()->mutable_status() = status(request.job().job(), caller);
                break;
            case v1::Request::kStats:
                *response.mutable_stats() = stats(request.stats().prometheus());
                break;
            case v1::Request::kHealth:
                *response.mutable_health() = health();
                break;
            case v1::Request::kPreview:
                *response.mutable_preview() = preview(request.preview(), caller);
                break;
            case v1::Request::kHello:
            case v1::Request::kWatch:
            case v1::Request::CALL_NOT_SET:
                throw ServiceError(v1::ERROR_CODE_PROTOCOL, "a request that this server does not know");
        }
    } catch (const ServiceError& e) {
        ++counters_.errors;
        if (queue_.has_changes() && e.code() == v1::ERROR_CODE_UNAVAILABLE) throw;
        *response.mutable_error() = error_message(e.code(), e.what());
    } catch (const Error& e) {
        ++counters_.errors;
        *response.mutable_error() = error_message(to_wire(e.code()), e.what());
    }
    return response;
}

void Service::check_may_see(std::uint64_t job, const Caller& caller) const
{
    const std::string owner = queue_.owner(job);
    if (owner.empty()) throw ServiceError(v1::ERROR_CODE_NOT_FOUND, "there is no job " + std::to_string(job));
    if (!caller.sees_all && owner != caller.owner) {
        throw ServiceError(v1::ERROR_CODE_FORBIDDEN, "job " + std::to_string(job) + " belongs to somebody else");
    }
}

void Service::check_space() const
{
    const double free = static_cast<double>(free_space(config_.state)) / kMega;
    if (free < config_.min_free_mb) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "the server's disk is nearly full: %.0f MB are free, %.0f MB are kept for jobs it has", free,
                      config_.min_free_mb);
        throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, text);
    }
}

v1::SubmitReply Service::submit(const v1::SubmitRequest& request, const Caller& caller)
{
    if (stopping_) throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "the server is stopping");
    check_space();
    const CheckedJob checked = check_job(request.job(), config_, blobs_);
    const auto submitted = queue_.submit(checked.job, caller.owner, checked.scene_key, checked.blobs, now_ms());
    ++(submitted.existed ? counters_.jobs_repeated : counters_.jobs_submitted);
    log_.info("job_submitted", {{"job", submitted.job},
                                {"owner", caller.owner},
                                {"scene", checked.job.scene().label()},
                                {"frames", std::max(1, checked.job.frames_size())},
                                {"existed", submitted.existed}});
    v1::SubmitReply reply;
    reply.set_job(submitted.job);
    reply.set_existed(submitted.existed);
    return reply;
}

v1::FetchReply Service::fetch(const v1::FetchRequest& request, const Caller& caller) const
{
    check_may_see(request.job(), caller);
    const auto index = queue_.index_of(request.job(), request.frame());
    const auto found = index ? queue_.file({request.job(), *index}, request.name()) : std::nullopt;
    if (!found) {
        throw ServiceError(v1::ERROR_CODE_NOT_FOUND, "job " + std::to_string(request.job()) + " has no picture " +
                                                         request.name().substr(0, 100) + " of frame " +
                                                         std::to_string(request.frame()));
    }
    const std::size_t length = request.length() != 0 ? std::min<std::size_t>(request.length(), kMaxChunk) : kMaxChunk;
    const auto& [file, path] = *found;
    v1::FetchReply reply;
    *reply.mutable_file() = file;
    if (request.offset() < file.size()) reply.set_data(read_part(results_path(path), request.offset(), length));
    if (request.offset() + reply.data().size() < file.size() && reply.data().size() < length) {
        throw ServiceError(v1::ERROR_CODE_IO, "the picture " + file.name() + " is shorter on disk than it was");
    }
    return reply;
}

v1::PreviewReply Service::preview(const v1::PreviewRequest& request, const Caller& caller) const
{
    check_may_see(request.job(), caller);
    const auto index = queue_.index_of(request.job(), request.frame());
    const RunningFrame* frame = index ? workers_.running({request.job(), *index}) : nullptr;
    if (frame == nullptr || frame->preview.empty()) {
        throw ServiceError(v1::ERROR_CODE_NOT_FOUND,
                           "there is no preview of frame " + std::to_string(request.frame()) + " now");
    }
    v1::PreviewReply reply;
    reply.set_jpeg(frame->preview);
    reply.set_number(frame->progress.preview_number());
    return reply;
}

v1::JobStatus Service::status(std::uint64_t job, const Caller& caller) const
{
    check_may_see(job, caller);
    v1::JobStatus status = *queue_.status(job);
    for (const Worker& worker : workers_.workers()) {
        if (worker.frame && worker.frame->key.job == job) *status.add_running() = worker.frame->progress;
    }
    return status;
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

v1::HealthReply Service::health() const
{
    v1::HealthReply reply;
    for (const Worker& worker : workers_.workers()) {
        reply.set_workers(reply.workers() + (worker.ready ? 1 : 0));
        reply.set_busy(reply.busy() + (worker.frame ? 1 : 0));
    }
    reply.set_queued_frames(queue_.count(v1::FRAME_STATE_QUEUED) + queue_.count(v1::FRAME_STATE_SOFT_FAILED));
    reply.set_uptime_seconds(1e-3 * static_cast<double>(now_ms() - started_ms_));
    std::string why = stopping_ ? "the server is stopping" : workers_.trouble();
    try {
        check_space();
    } catch (const ServiceError& e) {
        why = e.what();
    }
    if (!unsaved_.empty()) why = "pictures wait for the database to take them";
    reply.set_serving(why.empty());
    reply.set_message(why);
    return reply;
}

}  // namespace rcs::service
