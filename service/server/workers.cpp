#include "server/workers.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "process/clock.h"
#include "process/process.h"
#include "server/worker_process.h"
#include "wire/errors.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

constexpr std::int64_t kCancelGrace = 500;      // for a worker to end a frame by itself [ms]
constexpr std::int64_t kLeaveGrace = 3000;      // for a worker to end itself [ms]
constexpr std::int64_t kLongestPause = 60'000;  // between attempts to start a worker [ms]

bool is_idle(const Worker& worker)
{
    return worker.ready && !worker.frame && !worker.killed_for && !worker.outdated && !worker.leaving;
}

/// What it left: frames that it did not finish.
void leave_home(const Worker& worker)
{
    std::error_code ignored;
    std::filesystem::remove_all(worker.home, ignored);
}

}  // namespace

WorkerPool::WorkerPool(const ServerConfig& config, const ServerLog& log) : config_(config), log_(log) {}

WorkerPool::~WorkerPool() { stop(); }

void WorkerPool::spawn(std::int64_t now)
{
    Worker worker;
    worker.home = config_.state + "/" + kResults + "/" + kWorkerHome + random_id();
    make_private_folder(worker.home);
    WorkerProcess process = start_worker(config_, worker.home);
    worker.pid = process.pid;
    worker.socket = std::move(process.socket);
    worker.has_place = config_.engine == WorkerEngine::local;
    worker.roots = config_.roots;
    worker.since_ms = now;
    log_.info("worker_started", {{"pid", worker.pid}});
    workers_.push_back(std::move(worker));
}

void WorkerPool::kill(Worker& worker, v1::ErrorCode code, const std::string& why)
{
    if (worker.killed_for || worker.ended) return;
    worker.killed_for = error_message(code, why);
    worker.goes_since_ms = steady_ms();
    kill_worker(worker.pid, config_.engine);
    log_.write(Level::warning, "worker_killed", {{"pid", worker.pid}, {"why", why}});
}

void WorkerPool::adopt_config()
{
    for (Worker& worker : workers_) worker.outdated = worker.roots != config_.roots;
}

void WorkerPool::tend(std::int64_t now, std::size_t wanted, const std::function<bool(std::uint64_t)>& is_cancelled)
{
    while (workers_.size() < wanted && now >= next_start_ms_) {
        try {
            spawn(now);
        } catch (const ServiceError& e) {
            next_start_ms_ = now + 1000;
            log_.write(Level::error, "worker_not_started", {{"why", e.what()}});
        }
    }
    let_go(now, wanted);
    for (Worker& worker : workers_) {
        tend_worker(worker, now);
        if (worker.frame) tend_frame(worker, now, is_cancelled(worker.frame->key.job));
    }
}

/// Those that nobody needs, and that have done nothing for a while. Their places are others' then.
void WorkerPool::let_go(std::int64_t now, std::size_t wanted)
{
    const auto goes = [](const Worker& worker) { return worker.leaving || worker.killed_for; };
    auto staying = workers_.size() - static_cast<std::size_t>(std::count_if(workers_.begin(), workers_.end(), goes));
    const auto patience = static_cast<std::int64_t>(1e3 * config_.worker_idle);
    for (Worker& worker : workers_) {
        if (staying <= wanted) return;
        if (goes(worker) || worker.frame || now < std::max(worker.since_ms, worker.used_ms) + patience) continue;
        --staying;
        worker.leaving = true;
        worker.goes_since_ms = now;
        worker.ready ? static_cast<void>(::shutdown(worker.socket.get(), SHUT_WR))
                     : kill_worker(worker.pid, config_.engine);
    }
}

std::int64_t WorkerPool::next_deadline_ms() const
{
    std::int64_t next = INT64_MAX;
    const auto patience = static_cast<std::int64_t>(1e3 * config_.worker_start);
    for (const Worker& worker : workers_) {
        if (worker.killed_for) continue;
        if (!worker.ready && worker.has_place) next = std::min(next, worker.since_ms + patience);
        if (worker.frame) next = std::min(next, worker.frame->deadline_ms);
    }
    return next;
}

/// Those that hang or take too much memory are killed.
void WorkerPool::tend_worker(Worker& worker, std::int64_t now)
{
    char text[120];
    if (config_.engine == WorkerEngine::local) worker.memory = resident_memory(worker.pid);
    if (worker.goes_since_ms != 0 && now >= worker.goes_since_ms + kLeaveGrace) ::kill(worker.pid, SIGKILL);
    const double megabytes = 1e-6 * static_cast<double>(worker.memory);
    if (megabytes > config_.memory_limit_mb) {
        std::snprintf(text, sizeof text, "took %.0f MB of memory, more than the limit of %.0f MB", megabytes,
                      config_.memory_limit_mb);
        kill(worker, v1::ERROR_CODE_MEMORY_LIMIT, text);
    }
    if (worker.outdated && !worker.frame)
        kill(worker, v1::ERROR_CODE_INTERNAL, "its roots are not the server's any more");
    const auto patience = static_cast<std::int64_t>(1e3 * config_.worker_start);
    if (!worker.ready && worker.has_place && now >= worker.since_ms + patience) {
        std::snprintf(text, sizeof text, "was not ready after %.4g s", config_.worker_start);
        kill(worker, v1::ERROR_CODE_WORKER_DIED, text);
    }
    if (worker.frame && !worker.frame->begun && now >= worker.frame->started_ms + patience) {
        std::snprintf(text, sizeof text, "its worker did not begin within %.4g s", config_.worker_start);
        kill(worker, v1::ERROR_CODE_WORKER_DIED, text);
    }
    if (worker.frame && worker.frame->waits_since_ms != 0 && now >= worker.frame->heard_ms + patience) {
        std::snprintf(text, sizeof text, "its worker said nothing for %.4g s while the picture waited for room",
                      config_.worker_start);
        kill(worker, v1::ERROR_CODE_WORKER_DIED, text);
    }
}

void WorkerPool::tend_frame(Worker& worker, std::int64_t now, bool is_cancelled)
{
    RunningFrame& frame = *worker.frame;
    if (now >= frame.deadline_ms && frame.waits_since_ms == 0) {
        char text[120];
        std::snprintf(text, sizeof text, "took longer than the limit of %.4g s",
                      1e-3 * static_cast<double>(frame.deadline_ms - frame.started_ms));
        kill(worker, v1::ERROR_CODE_TIME_LIMIT, text);
    }
    if (frame.cancelled_ms == 0 && is_cancelled) {
        frame.cancelled_ms = now;
        internal::ToWorker message;
        message.set_cancel(true);
        send(worker, service::frame(message));
    }
    if (frame.cancelled_ms != 0 && now >= frame.cancelled_ms + kCancelGrace)
        kill(worker, v1::ERROR_CODE_CANCELLED, "cancelled");
}

bool WorkerPool::any_waits_for_space() const
{
    return std::any_of(workers_.begin(), workers_.end(),
                       [](const Worker& worker) { return worker.frame && worker.frame->waits_since_ms != 0; });
}

std::string WorkerPool::absence() const
{
    if (config_.engine == WorkerEngine::local) return "no worker is ready";
    if (workers_.empty()) return {};
    const bool wait = std::none_of(workers_.begin(), workers_.end(), [](const Worker& w) { return w.has_place; });
    return wait ? "frames wait until Slurm has room for a worker" : "no worker is ready";
}

bool WorkerPool::has_idle() const { return std::any_of(workers_.begin(), workers_.end(), is_idle); }

Worker* WorkerPool::idle(const std::string& scene_key)
{
    Worker* best = nullptr;
    for (Worker& worker : workers_) {
        if (!is_idle(worker)) continue;
        if (worker.scene_key == scene_key) return &worker;
        if (best == nullptr || worker.used_ms < best->used_ms) best = &worker;
    }
    return best;
}

void WorkerPool::send(Worker& worker, const std::string& bytes)
{
    worker.out += bytes;
    std::vector<FrameEnd> none;
    std::vector<std::uint64_t> nobody;
    serve(worker, false, true, none, nobody);
}

void WorkerPool::serve(Worker& worker, bool readable, bool writable, std::vector<FrameEnd>& ends,
                       std::vector<std::uint64_t>& changed)
{
    if (writable && !worker.out.empty()) {
        const ssize_t count = ::send(worker.socket.get(), worker.out.data(), worker.out.size(), MSG_NOSIGNAL);
        if (count > 0) worker.out.erase(0, static_cast<std::size_t>(count));
    }
    if (!readable) return;
    char bytes[64 << 10];
    const ssize_t count = ::recv(worker.socket.get(), bytes, sizeof bytes, 0);
    if (count <= 0) {
        // Its end follows; one that only closed the socket is of no use any more.
        if (count == 0 && !worker.ended) kill_worker(worker.pid, config_.engine);
        return;
    }
    try {
        worker.reader.append({bytes, static_cast<std::size_t>(count)});
        while (const auto message = worker.reader.next()) {
            internal::FromWorker from;
            parse(*message, from);
            handle(worker, from, ends, changed);
        }
    } catch (const ServiceError& e) {
        kill(worker, v1::ERROR_CODE_INTERNAL, std::string("its worker sent ") + e.what());
    }
}

/// @return whether that was of the worker, not of its frame
bool WorkerPool::hear_of_worker(Worker& worker, const internal::FromWorker& message)
{
    if (message.has_started()) {
        worker.has_place = true;
        worker.since_ms = steady_ms();
        worker.host = message.started();
        return true;
    }
    if (message.has_memory()) {
        worker.memory = message.memory();
        return true;
    }
    if (message.has_ready()) {
        worker.ready = true;
        worker.used_ms = steady_ms();
        failed_starts_ = 0;
        trouble_.clear();
        worker.seal = message.ready().seal();
        log_.write(message.ready().sealed() ? Level::info : Level::warning, "worker_ready",
                   {{"pid", worker.pid},
                    {"host", worker.host.empty() ? "here" : worker.host},
                    {"gl", message.ready().gl_renderer()},
                    {"kept_from", worker.seal}});
        return true;
    }
    return false;
}

void WorkerPool::handle(Worker& worker, internal::FromWorker& message, std::vector<FrameEnd>& ends,
                        std::vector<std::uint64_t>& changed)
{
    if (hear_of_worker(worker, message)) return;
    if (!worker.frame || message.task() != worker.frame->task) return;
    RunningFrame& frame = *worker.frame;
    frame.begun = true;
    frame.heard_ms = steady_ms();
    switch (message.message_case()) {
        case internal::FromWorker::kWaitsForSpace: {
            if (message.waits_for_space() == (frame.waits_since_ms != 0)) break;
            if (!message.waits_for_space()) frame.deadline_ms += frame.heard_ms - frame.waits_since_ms;
            frame.waits_since_ms = message.waits_for_space() ? frame.heard_ms : 0;
            log_.write(Level::warning, message.waits_for_space() ? "picture_waits_for_space" : "picture_found_space",
                       {{"job", frame.key.job}, {"frame", frame.progress.frame()}});
            break;
        }
        case internal::FromWorker::kProgress: {
            const std::uint32_t previews = frame.progress.preview_number();
            if (message.progress().stage() != frame.progress.stage()) frame.log.add(message.progress().stage());
            frame.progress = message.progress();
            frame.progress.set_preview_number(previews);
            changed.push_back(frame.key.job);
            break;
        }
        case internal::FromWorker::kPreview:
            frame.preview = std::move(*message.mutable_preview()->mutable_jpeg());
            frame.progress.set_preview_number(frame.progress.preview_number() + 1);
            changed.push_back(frame.key.job);
            break;
        case internal::FromWorker::kWarning: {
            constexpr std::size_t kMostWarnings = 100;
            if (frame.warnings.size() < kMostWarnings) frame.warnings.push_back(message.warning());
            frame.log.add("warning: " + message.warning());
            break;
        }
        case internal::FromWorker::kLog:
            frame.log.add(message.log());
            break;
        case internal::FromWorker::kDone:
        case internal::FromWorker::kFailed: {
            ends.push_back(end_of(std::move(frame), message));
            worker.frame.reset();
            worker.used_ms = steady_ms();
            break;
        }
        default:
            break;
    }
}

/// What a worker says of a frame's end. Pictures go to where no worker writes.
FrameEnd WorkerPool::end_of(RunningFrame frame, internal::FromWorker& message) const
{
    FrameEnd end{std::move(frame), std::nullopt, Ending::failed, message.failed()};
    const std::string kept = config_.state + "/" + end.frame.folder;
    if (message.has_done() && ::rename(end.frame.making.c_str(), kept.c_str()) == 0) {
        end.done = message.done();
    } else if (message.has_done()) {
        end.error = error_message(v1::ERROR_CODE_IO, std::string("its pictures are lost: ") + std::strerror(errno));
    }
    end.ending = ending_of(end.error.code());
    return end;
}

void WorkerPool::reap(std::vector<FrameEnd>& ends)
{
    for (auto worker = workers_.begin(); worker != workers_.end();) {
        int status = 0;
        if (::waitpid(worker->pid, &status, WNOHANG) != worker->pid) {
            ++worker;
            continue;
        }
        worker->ended = true;
        // What it said last may still lie in the socket.
        std::vector<std::uint64_t> nobody;
        for (int i = 0; i < 64 && !worker->killed_for; ++i) serve(*worker, true, false, ends, nobody);
        const std::string how = how_it_ended(status);
        if (worker->leaving && !worker->killed_for) {
            log_.info("worker_let_go", {{"pid", worker->pid}, {"host", worker->host}});
            leave_home(*worker);
            worker = workers_.erase(worker);
            continue;
        }
        log_.write(Level::warning, "worker_ended", {{"pid", worker->pid}, {"how", how}});
        if (worker->frame) {
            FrameEnd end{std::move(*worker->frame), std::nullopt, Ending::died, {}};
            end.error = worker->killed_for ? *worker->killed_for
                                           : error_message(v1::ERROR_CODE_WORKER_DIED, "its worker " + how);
            if (worker->killed_for) end.ending = ending_of(worker->killed_for->code());
            ends.push_back(std::move(end));
        }
        ++restarts_;
        if (!worker->ready) {
            const std::int64_t pause = std::min<std::int64_t>(kLongestPause, 1000LL << std::min(failed_starts_++, 6));
            next_start_ms_ = steady_ms() + pause;
            trouble_ = "workers do not start: the last one " +
                       (worker->killed_for ? worker->killed_for->message() : how) + "; the log says more";
        }
        leave_home(*worker);
        worker = workers_.erase(worker);
    }
}

std::vector<RunningFrame> WorkerPool::stop()
{
    std::vector<pid_t> pids;
    for (const Worker& worker : workers_) pids.push_back(worker.pid);
    end_workers(pids, config_.engine);
    std::vector<RunningFrame> frames;
    for (Worker& worker : workers_) {
        if (worker.frame) frames.push_back(std::move(*worker.frame));
        leave_home(worker);
    }
    workers_.clear();
    return frames;
}

const RunningFrame* WorkerPool::running(FrameKey key) const
{
    for (const Worker& worker : workers_) {
        if (worker.frame && worker.frame->key == key) return &*worker.frame;
    }
    return nullptr;
}

}  // namespace rcs::service
