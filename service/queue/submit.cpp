// How a job comes into the queue.
#include <algorithm>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "queue/job_queue.h"
#include "wire/errors.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

constexpr std::uint64_t kNumbersAtATime = 1000;  // that the marker is told of, so that it is seldom written

/// What an idempotency key stands for: the same job gives the same bytes.
std::string digest_of(const v1::Job& job)
{
    std::string bytes;
    {
        google::protobuf::io::StringOutputStream sink(&bytes);
        google::protobuf::io::CodedOutputStream stream(&sink);
        stream.SetSerializationDeterministic(true);  // labels are a map
        job.SerializeToCodedStream(&stream);
    }
    return sha256(bytes);
}

/// A job that names no frame has one.
std::int64_t frame_count(const v1::Job& job) { return std::max(1, job.frames_size()); }

}  // namespace

JobQueue::Submitted JobQueue::submit(const v1::Job& job, const std::string& owner, const std::string& scene_key,
                                     const std::set<std::string>& blobs, Moment now)
{
    const std::string digest = digest_of(job);
    if (!job.idempotency_key().empty()) {
        Statement same(database_, "SELECT id, digest FROM jobs WHERE owner=? AND key=?");
        if (same.bind(owner).bind(job.idempotency_key()).step()) {
            if (same.text(1) != digest) {
                throw ServiceError(v1::ERROR_CODE_CONFLICT, "the idempotency key " + job.idempotency_key() +
                                                                " belongs to job " + std::to_string(same.integer(0)) +
                                                                ", which asks for something else");
            }
            return {static_cast<std::uint64_t>(same.integer(0)), true};
        }
    }
    for (const std::uint64_t after : job.after()) {
        if (!status(after)) {
            throw ServiceError(v1::ERROR_CODE_NOT_FOUND,
                               "there is no job " + std::to_string(after) + ", which this one is to wait for");
        }
    }
    check_room(1, static_cast<std::uint64_t>(frame_count(job)), owner);
    reserve_number();
    begin(Transaction::durable);
    const std::int64_t id = insert_job(job, owner, digest, scene_key, now);
    share_.add(static_cast<std::uint64_t>(id), owner, job.priority(), false, clock_ms(now));
    insert_frames(job, id, now);
    keep_clock(now);
    Statement label(database_, "INSERT INTO labels (job, name, value) VALUES (?, ?, ?)");
    for (const auto& [name, value] : job.labels()) label.bind(id).bind(name).bind(value).run();
    Statement blob(database_, "INSERT INTO job_blobs (job, digest) VALUES (?, ?)");
    for (const std::string& needed : blobs) blob.bind(id).bind_blob(needed).run();
    wait_for(static_cast<std::uint64_t>(id), job, now);
    return {static_cast<std::uint64_t>(id), false};
}

/// @param jobs, frames  more that are unfinished @throws ServiceError limit, where the queue has no room for them
void JobQueue::check_room(std::uint64_t jobs, std::uint64_t frames, const std::string& owner) const
{
    std::uint64_t waiting_jobs = 0, waiting_frames = 0;
    for (const auto state :
         {v1::JOB_STATE_QUEUED, v1::JOB_STATE_RUNNING, v1::JOB_STATE_PAUSED, v1::JOB_STATE_CANCEL_REQUESTED})
        waiting_jobs += count(state);
    for (const auto state : {v1::FRAME_STATE_QUEUED, v1::FRAME_STATE_ACTIVE, v1::FRAME_STATE_SOFT_FAILED})
        waiting_frames += count(state);
    if (waiting_jobs + jobs > static_cast<std::uint64_t>(options_.max_unfinished_jobs) ||
        waiting_frames + frames > static_cast<std::uint64_t>(options_.max_unfinished_frames)) {
        throw ServiceError(v1::ERROR_CODE_LIMIT,
                           "the queue is full: " + std::to_string(waiting_jobs) + " unfinished jobs of at most " +
                               std::to_string(options_.max_unfinished_jobs) + ", " + std::to_string(waiting_frames) +
                               " unfinished frames of at most " + std::to_string(options_.max_unfinished_frames));
    }
    const auto of_owner = static_cast<std::uint64_t>(share_.frames_of(owner));
    if (options_.max_owner_frames > 0 && of_owner + frames > static_cast<std::uint64_t>(options_.max_owner_frames)) {
        throw ServiceError(v1::ERROR_CODE_LIMIT, owner + " has " + std::to_string(of_owner) +
                                                     " unfinished frames; with " + std::to_string(frames) +
                                                     " more it were over the " +
                                                     std::to_string(options_.max_owner_frames) + " that each may have");
    }
}

/// Tells the marker of the numbers that come next, before they are given.
void JobQueue::reserve_number()
{
    Statement last(database_, "SELECT max(seq) FROM sqlite_sequence");
    const std::uint64_t next = (last.step() ? static_cast<std::uint64_t>(last.integer(0)) : 0) + 1;
    if (next <= marker_.numbers) return;
    Marker ahead = marker_;
    ahead.numbers = next + kNumbersAtATime;
    write_marker(state_, ahead);
    marker_ = ahead;
}

/// @return its number
std::int64_t JobQueue::insert_job(const v1::Job& job, const std::string& owner, const std::string& digest,
                                  const std::string& scene_key, Moment now)
{
    v1::Job spec = job;
    spec.clear_frames();
    Statement insert(
        database_,
        "INSERT INTO jobs (owner, key, digest, spec, scene, scene_key, priority, state, submitted, frames, entered) "
        "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    insert.bind(owner);
    job.idempotency_key().empty() ? insert.bind_null() : insert.bind(job.idempotency_key());
    insert.bind_blob(digest)
        .bind_blob(spec.SerializeAsString())
        .bind(job.scene().label())
        .bind(scene_key)
        .bind(std::int64_t{job.priority()})
        .bind(std::int64_t{v1::JOB_STATE_QUEUED})
        .bind(now.wall_ms)
        .bind(frame_count(job))
        .bind(clock_ms(now))
        .run();
    ++tally_.jobs[v1::JOB_STATE_QUEUED];
    return database_.last_row();
}

void JobQueue::insert_frames(const v1::Job& job, std::int64_t id, Moment now)
{
    Statement frame(database_, "INSERT INTO frames (job, idx, number, spec, state) VALUES (?, ?, ?, ?, 1)");
    for (std::int64_t i = 0; i < frame_count(job); ++i) {
        const v1::Frame one = job.frames_size() > 0 ? job.frames(static_cast<int>(i)) : v1::Frame();
        frame.bind(id).bind(i).bind(std::int64_t{one.number()}).bind_blob(one.SerializeAsString()).run();
    }
    tally_.frames[v1::FRAME_STATE_QUEUED] += static_cast<std::uint64_t>(frame_count(job));
    share_.set_frames(static_cast<std::uint64_t>(id), {frame_count(job), 0, 0, 0}, clock_ms(now));
}

}  // namespace rcs::service
