// What Service tells of itself in numbers.
#include <cstdio>
#include <fstream>

#include <unistd.h>

#include "server/service.h"

namespace rcs::service {
namespace {

/// Resident memory of this process [bytes].
double own_memory()
{
    std::ifstream file("/proc/self/statm");
    double all = 0.0, resident = 0.0;
    file >> all >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

struct Value {
    const char* name;
    const char* kind;  ///< of Prometheus
    const char* help;
    double value;
};

}  // namespace

v1::StatsReply Service::stats(bool prometheus) const
{
    const auto number = [](std::uint64_t count) { return static_cast<double>(count); };
    const v1::HealthReply state = health();
    double worker_memory = 0.0;
    for (const Worker& worker : workers_.workers()) worker_memory += number(worker.memory);
    const Value values[] = {
        {"rcsplat_up_seconds", "gauge", "Time since the server's start", state.uptime_seconds()},
        {"rcsplat_serving", "gauge", "1 while jobs are taken", state.serving() ? 1.0 : 0.0},
        {"rcsplat_paused_for_space", "gauge", "1 while frames wait for room on the disk",
         reason_to_wait().empty() ? 0.0 : 1.0},
        {"rcsplat_queue_paused", "gauge", "1 while somebody holds the whole queue", queue_.is_paused() ? 1.0 : 0.0},
        {"rcsplat_jobs_submitted_total", "counter", "Jobs taken", number(counters_.jobs_submitted)},
        {"rcsplat_jobs_repeated_total", "counter", "Submits whose idempotency key was known",
         number(counters_.jobs_repeated)},
        {"rcsplat_jobs_expired_total", "counter", "Ended jobs that were removed", number(counters_.jobs_expired)},
        {"rcsplat_jobs_unfinished", "gauge", "Jobs that wait or run",
         number(queue_.count(v1::JOB_STATE_QUEUED) + queue_.count(v1::JOB_STATE_RUNNING) +
                queue_.count(v1::JOB_STATE_PAUSED) + queue_.count(v1::JOB_STATE_CANCEL_REQUESTED))},
        {"rcsplat_frames_waiting", "gauge", "Frames that wait", number(state.queued_frames())},
        {"rcsplat_queue_eta_seconds", "gauge", "Estimated time until nothing waits; 0: unknown", state.eta_seconds()},
        {"rcsplat_frames_running", "gauge", "Frames being rendered", number(state.busy())},
        {"rcsplat_frames_completed_total", "counter", "Frames rendered", number(counters_.frames_completed)},
        {"rcsplat_frames_failed_total", "counter", "Frames given up", number(counters_.frames_failed)},
        {"rcsplat_frames_retried_total", "counter", "Tries that failed and may be repeated",
         number(counters_.frames_retried)},
        {"rcsplat_frame_seconds_total", "counter", "Wall time of completed frames", counters_.frame_seconds},
        {"rcsplat_workers", "gauge", "Workers that are ready", number(state.workers())},
        {"rcsplat_worker_restarts_total", "counter", "Workers that ended", number(workers_.restarts())},
        {"rcsplat_worker_memory_bytes", "gauge", "Resident memory of the workers", worker_memory},
        {"rcsplat_server_memory_bytes", "gauge", "Resident memory of the server", own_memory()},
        {"rcsplat_requests_total", "counter", "Requests", number(counters_.requests)},
        {"rcsplat_errors_total", "counter", "Requests answered by an error", number(counters_.errors)},
        {"rcsplat_connections_total", "counter", "Connections taken", number(counters_.connections.load())},
        {"rcsplat_connections_refused_total", "counter", "Connections refused",
         number(counters_.connections_refused.load())},
        {"rcsplat_upload_bytes", "gauge", "Uploaded files held", number(blobs_.bytes())},
        {"rcsplat_disk_free_bytes", "gauge", "Space on the state's disk", number(free_space(config_.state))},
    };
    v1::StatsReply reply;
    for (const Value& value : values) {
        (*reply.mutable_values())[value.name] = value.value;
        if (!prometheus) continue;
        char text[320];
        std::snprintf(text, sizeof text, "# HELP %s %s\n# TYPE %s %s\n%s %.17g\n", value.name, value.help, value.name,
                      value.kind, value.name, value.value);
        *reply.mutable_prometheus() += text;
    }
    return reply;
}

}  // namespace rcs::service
