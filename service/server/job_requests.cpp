// What Service answers clients about jobs: taking, ending, holding and trying them again.
#include <algorithm>

#include "server/check_job.h"
#include "server/service.h"
#include "wire/errors.h"

namespace rcs::service {

void Service::check_may_see(std::uint64_t job, const Caller& caller) const
{
    const std::string owner = queue_.owner(job);
    if (owner.empty()) throw ServiceError(v1::ERROR_CODE_NOT_FOUND, "there is no job " + std::to_string(job));
    if (!caller.sees_all && owner != caller.owner) {
        throw ServiceError(v1::ERROR_CODE_FORBIDDEN, "job " + std::to_string(job) + " belongs to somebody else");
    }
}

v1::SubmitReply Service::submit(const v1::SubmitRequest& request, const Caller& caller)
{
    if (stopping_) throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "the server is stopping");
    check_space();
    const CheckedJob checked = check_job(request.job(), config_, blobs_);
    for (const std::uint64_t after : checked.job.after()) {
        if (!queue_.owner(after).empty()) check_may_see(after, caller);
    }
    const auto submitted = queue_.submit(checked.job, caller.owner, checked.scene_key, checked.blobs, read_clocks());
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

v1::CancelReply Service::cancel(const v1::CancelRequest& request, const Caller& caller)
{
    check_may_see(request.job(), caller);
    v1::CancelReply reply;
    reply.set_had_ended(has_ended(queue_.status(request.job())->state()));
    reply.set_state(*queue_.cancel(request.job(), read_clocks()));
    if (!reply.had_ended()) log_.info("job_cancelled", {{"job", request.job()}, {"by", caller.owner}});
    return reply;
}

v1::RetryReply Service::retry(const v1::RetryRequest& request, const Caller& caller)
{
    if (stopping_) throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "the server is stopping");
    check_may_see(request.job(), caller);
    check_space();
    for (const std::string& digest : queue_.blobs_of(request.job())) {
        if (!blobs_.has(digest)) {
            throw ServiceError(v1::ERROR_CODE_MISSING_BLOBS, "files of job " + std::to_string(request.job()) +
                                                                 " are no longer here; submit it again");
        }
    }
    const std::vector<int> numbers(request.frames().begin(), request.frames().end());
    v1::RetryReply reply;
    reply.set_frames(static_cast<std::uint32_t>(queue_.retry(request.job(), numbers, read_clocks())));
    reply.set_state(queue_.status(request.job())->state());
    log_.info("job_retried", {{"job", request.job()}, {"frames", reply.frames()}, {"by", caller.owner}});
    return reply;
}

v1::PauseReply Service::pause(const v1::PauseRequest& request, const Caller& caller)
{
    v1::PauseReply reply;
    const char* const what = request.resume() ? "resumed" : "paused";
    if (request.job() == 0) {
        if (!caller.sees_all)
            throw ServiceError(v1::ERROR_CODE_FORBIDDEN, "the whole queue is held by the server's own user alone");
        reply.set_was_so(!queue_.pause_all(!request.resume()));
        log_.info(std::string("queue_") + what, {{"by", caller.owner}});
        return reply;
    }
    check_may_see(request.job(), caller);
    const v1::JobState state = queue_.status(request.job())->state();
    if (has_ended(state) || state == v1::JOB_STATE_CANCEL_REQUESTED) {
        throw ServiceError(v1::ERROR_CODE_CONFLICT,
                           "job " + std::to_string(request.job()) + " has ended, or is being ended");
    }
    reply.set_was_so(!queue_.pause(request.job(), !request.resume(), read_clocks()));
    reply.set_state(queue_.status(request.job())->state());
    log_.info(std::string("job_") + what, {{"job", request.job()}, {"by", caller.owner}});
    return reply;
}

v1::PriorityReply Service::set_priority(const v1::PriorityRequest& request, const Caller& caller)
{
    check_may_see(request.job(), caller);
    check_priority(request.priority());
    v1::PriorityReply reply;
    reply.set_before(queue_.set_priority(request.job(), request.priority(), read_clocks()));
    log_.info("job_priority", {{"job", request.job()}, {"priority", request.priority()}, {"by", caller.owner}});
    return reply;
}

v1::LogsReply Service::logs(const v1::LogsRequest& request, const Caller& caller) const
{
    check_may_see(request.job(), caller);
    const auto index = queue_.index_of(request.job(), request.frame());
    if (!index) {
        throw ServiceError(v1::ERROR_CODE_NOT_FOUND,
                           "job " + std::to_string(request.job()) + " has no frame " + std::to_string(request.frame()));
    }
    const FrameKey key{request.job(), *index};
    v1::LogsReply reply;
    reply.set_text(utf8_text(logs_.read(key)));
    if (const RunningFrame* frame = workers_.running(key)) *reply.mutable_text() += frame->log.text();
    return reply;
}

v1::ListReply Service::list(const v1::ListRequest& request, const Caller& caller) const
{
    if (request.limit() > 1000) throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT, "limit is above 1000");
    v1::ListReply reply = queue_.list(request, caller.sees_all ? "" : caller.owner);
    for (v1::JobStatus& status : *reply.mutable_jobs()) add_outlook(status);
    return reply;
}

v1::JobReply Service::details(const v1::JobRequest& request, const Caller& caller) const
{
    if (request.frames() > 500) throw ServiceError(v1::ERROR_CODE_BAD_ARGUMENT, "frames is above 500");
    check_may_see(request.job(), caller);
    v1::JobReply reply = queue_.details(request);
    *reply.mutable_status() = status(request.job(), caller);
    return reply;
}

v1::JobStatus Service::status(std::uint64_t job, const Caller& caller) const
{
    check_may_see(job, caller);
    v1::JobStatus status = *queue_.status(job);
    for (const Worker& worker : workers_.workers()) {
        if (worker.frame && worker.frame->key.job == job) *status.add_running() = worker.frame->progress;
    }
    add_outlook(status);
    return status;
}

/// What is known of a job's progress beyond its rows.
void Service::add_outlook(v1::JobStatus& status) const
{
    const FairShare& share = queue_.share();
    if (!share.has(status.job())) return;
    if (status.started_ms() == 0)
        status.set_waited_seconds(1e-3 * static_cast<double>(queue_clock_ms() - share.entered_ms(status.job())));
    double fraction = status.fraction();
    for (const v1::Progress& progress : status.running()) fraction += double{progress.fraction()} / status.frames();
    status.set_fraction(std::clamp(fraction, 0.0, 1.0));
    if (queue_.is_paused()) return;
    if (const auto eta = share.eta_seconds(status.job(), config_.workers)) status.set_eta_seconds(*eta);
}

}  // namespace rcs::service
