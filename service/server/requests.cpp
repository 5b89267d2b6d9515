// What Service answers clients about files, pictures and itself; job_requests.cpp about jobs.
#include <algorithm>
#include <cstdio>

#include "rcs/error.h"
#include "server/service.h"
#include "server/sockets.h"
#include "wire/errors.h"
#include "wire/framing.h"
#include "wire/outputs.h"
#include "wire/sha256.h"

namespace rcs::service {
v1::Response Service::answer(const v1::Request& request, const Caller& caller)
{
    ++counters_.requests;
    v1::Response response;
    try {
        response = reply_to(request, caller);
    } catch (const ServiceError& e) {
        ++counters_.errors;
        if (queue_.has_changes() && e.code() == v1::ERROR_CODE_UNAVAILABLE) throw;
        *response.mutable_error() = error_message(e.code(), e.what());
    } catch (const Error& e) {
        ++counters_.errors;
        *response.mutable_error() = error_message(to_wire(e.code()), e.what());
    }
    response.set_id(request.id());
    return response;
}

v1::Response Service::reply_to(const v1::Request& request, const Caller& caller)
{
    v1::Response response;
    switch (request.call_case()) {
        case v1::Request::kBlobStatus:
            *response.mutable_blob_status() = held(request.blob_status(), caller);
            break;
        case v1::Request::kBlobPut:
            *response.mutable_blob_put() = put(request.blob_put(), caller);
            break;
        case v1::Request::kSubmit:
            *response.mutable_submit() = submit(request.submit(), caller);
            break;
        case v1::Request::kFetch:
            *response.mutable_fetch() = fetch(request.fetch(), caller);
            break;
        case v1::Request::kCancel:
            *response.mutable_cancel() = cancel(request.cancel(), caller);
            break;
        case v1::Request::kList:
            *response.mutable_list() = list(request.list(), caller);
            break;
        case v1::Request::kJob:
            *response.mutable_job() = details(request.job(), caller);
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
        case v1::Request::kRetry:
            *response.mutable_retry() = retry(request.retry(), caller);
            break;
        case v1::Request::kPause:
            *response.mutable_pause() = pause(request.pause(), caller);
            break;
        case v1::Request::kPriority:
            *response.mutable_priority() = set_priority(request.priority(), caller);
            break;
        case v1::Request::kLogs:
            *response.mutable_logs() = logs(request.logs(), caller);
            break;
        case v1::Request::kHello:
        case v1::Request::kWatch:
        case v1::Request::CALL_NOT_SET:
            throw ServiceError(v1::ERROR_CODE_PROTOCOL, "a request that this server does not know");
    }
    return response;
}

void Service::check_space() const
{
    const double free = free_mb();
    if (free < config_.min_free_mb) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "the server's disk is nearly full: %.0f MB are free, %.0f MB are kept for jobs it has", free,
                      config_.min_free_mb);
        throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, text);
    }
}

v1::BlobStatusReply Service::held(const v1::BlobStatusRequest& request, const Caller& caller)
{
    v1::BlobStatusReply reply;
    for (const v1::Blob& blob : request.blobs()) reply.add_held(blobs_.held(blob, caller.owner, queue_clock_ms()));
    return reply;
}

v1::BlobPutReply Service::put(const v1::BlobPutRequest& request, const Caller& caller)
{
    if (request.data().size() > kMaxChunk)
        throw ServiceError(v1::ERROR_CODE_LIMIT, "a chunk is larger than max_chunk_bytes");
    if (stopping_) throw ServiceError(v1::ERROR_CODE_UNAVAILABLE, "the server is stopping");
    check_space();
    v1::BlobPutReply reply;
    reply.set_held(blobs_.put(request.blob(), caller.owner, request.offset(), request.data(), queue_clock_ms(),
                              caller.connection));
    return reply;
}

v1::FetchReply Service::fetch(const v1::FetchRequest& request, const Caller& caller) const
{
    check_may_see(request.job(), caller);
    if (request.name().empty()) return fetch_small_picture(request);
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
    if (request.offset() < file.size()) reply.set_data(read_part(path_of(path), request.offset(), length));
    if (request.offset() + reply.data().size() < file.size() && reply.data().size() < length) {
        throw ServiceError(v1::ERROR_CODE_IO, "the picture " + file.name() + " is shorter on disk than it was");
    }
    return reply;
}

/// The one that the worker made beside the frame's files: a few kilobytes.
v1::FetchReply Service::fetch_small_picture(const v1::FetchRequest& request) const
{
    const std::string bytes = read_part(picture_path(request.job(), request.frame(), ""), 0, kMaxChunk);
    Sha256 sum;
    sum.add(bytes);
    v1::FetchReply reply;
    reply.mutable_file()->set_size(bytes.size());
    reply.mutable_file()->set_sha256(sum.digest());
    if (request.offset() < bytes.size()) reply.set_data(bytes.substr(request.offset()));
    return reply;
}

std::string Service::picture_path(std::uint64_t job, int frame, const std::string& name) const
{
    const auto index = queue_.index_of(job, frame);
    if (index && name.empty()) {
        const std::string folder = queue_.folder({job, *index});
        if (!folder.empty()) return path_of(folder) + "/" + kThumbnail;
    } else if (index) {
        if (const auto found = queue_.file({job, *index}, name)) return path_of(found->second);
    }
    throw ServiceError(v1::ERROR_CODE_NOT_FOUND, "there is no such picture");
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

v1::HealthReply Service::health() const
{
    v1::HealthReply reply;
    for (const Worker& worker : workers_.workers()) {
        reply.set_workers(reply.workers() + (worker.ready ? 1 : 0));
        reply.set_busy(reply.busy() + (worker.frame ? 1 : 0));
        if (!worker.seal.empty()) reply.set_seal(worker.seal);
    }
    reply.set_queued_frames(queue_.count(v1::FRAME_STATE_QUEUED) + queue_.count(v1::FRAME_STATE_SOFT_FAILED));
    reply.set_uptime_seconds(1e-3 * static_cast<double>(steady_ms() - started_ms_));
    std::string why = stopping_ ? "the server is stopping" : workers_.trouble();
    try {
        check_space();
    } catch (const ServiceError& e) {
        why = e.what();
    }
    if (const std::string paused = reason_to_wait(); !paused.empty()) why = paused;
    if (!not_scheduled_.empty()) why = not_scheduled_;
    if (!unsaved_.empty()) why = "pictures wait for the database to take them";
    if (why.empty() && reply.workers() == 0) why = workers_.absence();
    reply.set_serving(why.empty());
    reply.set_paused(queue_.is_paused());
    if (why.empty() && queue_.is_paused()) why = "the queue is paused: jobs are taken, no frame is started";
    reply.set_message(why);
    const auto eta = queue_.is_paused() ? std::nullopt : queue_.share().eta_seconds(config_.workers);
    if (eta) reply.set_eta_seconds(*eta);
    return reply;
}

}  // namespace rcs::service
