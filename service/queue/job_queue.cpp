// What changes the queue; job_rows.cpp reads it.
#include "queue/job_queue.h"

#include <algorithm>
#include <cmath>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "queue/schema.h"
#include "wire/errors.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

// As the tables of queue/schema.h have them.
static_assert(v1::FRAME_STATE_QUEUED == 1 && v1::FRAME_STATE_ACTIVE == 2 && v1::FRAME_STATE_SOFT_FAILED == 3);

constexpr double kLongestBackoff = 300.0;  // [s]

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

bool has_ended(v1::JobState state)
{
    return state == v1::JOB_STATE_CANCELLED || state == v1::JOB_STATE_COMPLETED ||
           state == v1::JOB_STATE_COMPLETED_WITH_WARNINGS || state == v1::JOB_STATE_FAILED;
}

JobQueue::JobQueue(const std::string& path, const QueueOptions& options, std::int64_t now_ms)
    : database_(path), options_(options)
{
    database_.run(
        "PRAGMA journal_mode=WAL; PRAGMA foreign_keys=ON; PRAGMA temp_store=MEMORY; PRAGMA "
        "journal_size_limit=16777216");
    Statement version(database_, "PRAGMA user_version");
    version.step();
    const auto found = version.integer(0);
    version.step();
    if (found != 0 && found != kSchema) {
        throw ServiceError(v1::ERROR_CODE_UNSUPPORTED, path + " has version " + std::to_string(found) +
                                                           " of the queue, expected " + std::to_string(kSchema));
    }
    begin(Transaction::durable);
    if (found == 0) {
        database_.run(kTables);
        database_.run("PRAGMA user_version=1");
    }
    for (const FrameKey& key : active_frames()) recover(key, now_ms);
    commit();
}

/// A frame that ran when the server ended.
void JobQueue::recover(FrameKey key, std::int64_t now_ms)
{
    const auto job = static_cast<std::int64_t>(key.job);
    Statement row(database_,
                  "SELECT f.starts, j.state FROM frames f JOIN jobs j ON j.id=f.job WHERE f.job=? AND f.idx=?");
    row.bind(job).bind(std::int64_t{key.index}).step();
    if (row.integer(1) == v1::JOB_STATE_CANCEL_REQUESTED) {
        set_frame(key, v1::FRAME_STATE_CANCELLED, error_message(v1::ERROR_CODE_CANCELLED, "cancelled"), 0, now_ms);
    } else if (row.integer(0) >= options_.max_starts) {
        set_frame(key, v1::FRAME_STATE_FAILED,
                  error_message(v1::ERROR_CODE_WORKER_DIED, "was started " + std::to_string(row.integer(0)) +
                                                                " times, and the server ended each time before it did"),
                  0, now_ms);
    } else {
        set_frame(key, v1::FRAME_STATE_QUEUED, {}, 0, 0);
    }
    settle(key.job, now_ms);
}

void JobQueue::begin(Transaction kind)
{
    if (transaction_ == Transaction::plain && kind == Transaction::durable) commit();
    if (transaction_ != Transaction::none) return;
    database_.run(kind == Transaction::durable ? "PRAGMA synchronous=FULL" : "PRAGMA synchronous=NORMAL");
    database_.run("BEGIN IMMEDIATE");
    transaction_ = kind;
}

void JobQueue::commit()
{
    if (transaction_ == Transaction::none) return;
    try {
        database_.run("COMMIT");
    } catch (const ServiceError&) {
        roll_back();
        throw;
    }
    transaction_ = Transaction::none;
}

void JobQueue::roll_back()
{
    if (transaction_ == Transaction::none) return;
    transaction_ = Transaction::none;
    try {
        database_.run("ROLLBACK");
    } catch (const ServiceError&) {
        // SQLite has rolled back by itself, as it does on a full disk.
    }
}

JobQueue::Submitted JobQueue::submit(const v1::Job& job, const std::string& owner, const std::string& scene_key,
                                     const std::set<std::string>& blobs, std::int64_t now_ms)
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
    check_room(job);
    begin(Transaction::durable);
    const std::int64_t id = insert_job(job, owner, digest, scene_key, now_ms);
    insert_frames(job, id, now_ms);
    Statement blob(database_, "INSERT INTO job_blobs (job, digest) VALUES (?, ?)");
    for (const std::string& needed : blobs) blob.bind(id).bind_blob(needed).run();
    return {static_cast<std::uint64_t>(id), false};
}

/// @throws ServiceError limit, where the queue has no room for it
void JobQueue::check_room(const v1::Job& job) const
{
    std::uint64_t waiting_jobs = 0, waiting_frames = 0;
    for (const auto state : {v1::JOB_STATE_QUEUED, v1::JOB_STATE_RUNNING, v1::JOB_STATE_CANCEL_REQUESTED})
        waiting_jobs += count(state);
    for (const auto state : {v1::FRAME_STATE_QUEUED, v1::FRAME_STATE_ACTIVE, v1::FRAME_STATE_SOFT_FAILED})
        waiting_frames += count(state);
    const auto frames = static_cast<std::uint64_t>(frame_count(job));
    if (waiting_jobs >= static_cast<std::uint64_t>(options_.max_unfinished_jobs) ||
        waiting_frames + frames > static_cast<std::uint64_t>(options_.max_unfinished_frames)) {
        throw ServiceError(v1::ERROR_CODE_LIMIT,
                           "the queue is full: " + std::to_string(waiting_jobs) + " unfinished jobs of at most " +
                               std::to_string(options_.max_unfinished_jobs) + ", " + std::to_string(waiting_frames) +
                               " unfinished frames of at most " + std::to_string(options_.max_unfinished_frames));
    }
}

/// @return its number
std::int64_t JobQueue::insert_job(const v1::Job& job, const std::string& owner, const std::string& digest,
                                  const std::string& scene_key, std::int64_t now_ms)
{
    v1::Job spec = job;
    spec.clear_frames();
    Statement insert(
        database_,
        "INSERT INTO jobs (owner, key, digest, spec, scene, scene_key, priority, state, submitted, frames) "
        "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    insert.bind(owner);
    job.idempotency_key().empty() ? insert.bind_null() : insert.bind(job.idempotency_key());
    insert.bind_blob(digest)
        .bind_blob(spec.SerializeAsString())
        .bind(job.scene().label())
        .bind(scene_key)
        .bind(std::int64_t{job.priority()})
        .bind(std::int64_t{v1::JOB_STATE_QUEUED})
        .bind(now_ms)
        .bind(frame_count(job))
        .run();
    return database_.last_row();
}

void JobQueue::insert_frames(const v1::Job& job, std::int64_t id, std::int64_t now_ms)
{
    const double rank = job.priority() - static_cast<double>(now_ms) * 1e-3 / options_.ageing_seconds;
    Statement frame(database_, "INSERT INTO frames (job, idx, number, spec, state, rank) VALUES (?, ?, ?, ?, 1, ?)");
    for (std::int64_t i = 0; i < frame_count(job); ++i) {
        const v1::Frame one = job.frames_size() > 0 ? job.frames(static_cast<int>(i)) : v1::Frame();
        frame.bind(id).bind(i).bind(std::int64_t{one.number()}).bind_blob(one.SerializeAsString()).bind(rank).run();
    }
}

void JobQueue::start(FrameKey key, std::int64_t now_ms)
{
    begin(Transaction::plain);
    const auto job = static_cast<std::int64_t>(key.job);
    Statement(database_, "UPDATE frames SET state=2, starts=starts+1, started=? WHERE job=? AND idx=?")
        .bind(now_ms)
        .bind(job)
        .bind(std::int64_t{key.index})
        .run();
    Statement(
        database_,
        "UPDATE jobs SET state=?, active=active+1, started=CASE started WHEN 0 THEN ? ELSE started END WHERE id=?")
        .bind(std::int64_t{v1::JOB_STATE_RUNNING})
        .bind(now_ms)
        .bind(job)
        .run();
}

void JobQueue::complete(FrameKey key, const Completed& result, std::int64_t now_ms)
{
    begin(Transaction::durable);
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    std::string warnings;
    for (const std::string& line : result.warnings) warnings += line + "\n";
    set_frame(key, v1::FRAME_STATE_COMPLETED, {}, 0, now_ms);
    Statement(database_, "UPDATE frames SET folder=?, estimate=?, stats=?, warnings=? WHERE job=? AND idx=?")
        .bind(result.folder)
        .bind(result.error_estimate)
        .bind(result.stats_json)
        .bind(warnings)
        .bind(job)
        .bind(index)
        .run();
    Statement insert(database_, "INSERT INTO files (job, idx, name, size, sha256) VALUES (?, ?, ?, ?, ?)");
    for (const v1::OutputFile& file : result.files) {
        insert.bind(job)
            .bind(index)
            .bind(file.name())
            .bind(static_cast<std::int64_t>(file.size()))
            .bind_blob(file.sha256())
            .run();
    }
    settle(key.job, now_ms);
}

void JobQueue::fail(FrameKey key, Ending ending, const v1::Error& error, std::int64_t now_ms)
{
    begin(Transaction::durable);
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    if (is_cancelled(key.job)) {
        set_frame(key, v1::FRAME_STATE_CANCELLED, error_message(v1::ERROR_CODE_CANCELLED, "cancelled"), 0, now_ms);
        settle(key.job, now_ms);
        return;
    }
    Statement(database_, "UPDATE frames SET tries=tries+1, deaths=deaths+? WHERE job=? AND idx=?")
        .bind(std::int64_t{ending == Ending::died})
        .bind(job)
        .bind(index)
        .run();
    Statement row(database_, "SELECT tries, deaths, starts FROM frames WHERE job=? AND idx=?");
    row.bind(job).bind(index).step();
    const auto tries = row.integer(0);
    const bool again = ending != Ending::failed && tries < options_.max_tries && row.integer(1) < options_.max_deaths &&
                       row.integer(2) < options_.max_starts;
    const double wait =
        std::min(kLongestBackoff, options_.backoff_seconds * std::pow(4.0, static_cast<double>(tries - 1)));
    row.step();
    set_frame(key, again ? v1::FRAME_STATE_SOFT_FAILED : v1::FRAME_STATE_FAILED, error,
              again ? now_ms + std::llround(1e3 * wait) : 0, now_ms);
    settle(key.job, now_ms);
}

std::optional<v1::JobState> JobQueue::cancel(std::uint64_t job, std::int64_t now_ms)
{
    const auto before = status(job);
    if (!before) return std::nullopt;
    if (has_ended(before->state())) return before->state();
    begin(Transaction::durable);
    const auto id = static_cast<std::int64_t>(job);
    Statement(database_,
              "UPDATE frames SET state=?, finished=?, error_code=?, error='cancelled' WHERE job=? AND state IN (1, 3)")
        .bind(std::int64_t{v1::FRAME_STATE_CANCELLED})
        .bind(now_ms)
        .bind(std::int64_t{v1::ERROR_CODE_CANCELLED})
        .bind(id)
        .run();
    Statement(database_, "UPDATE jobs SET state=? WHERE id=?")
        .bind(std::int64_t{v1::JOB_STATE_CANCEL_REQUESTED})
        .bind(id)
        .run();
    settle(job, now_ms);
    return status(job)->state();
}

void JobQueue::give_back(FrameKey key)
{
    begin(Transaction::plain);
    Statement(database_, "UPDATE frames SET state=1, starts=starts-1 WHERE job=? AND idx=?")
        .bind(static_cast<std::int64_t>(key.job))
        .bind(std::int64_t{key.index})
        .run();
    settle(key.job, 0);
}

void JobQueue::remove(std::uint64_t job)
{
    begin(Transaction::durable);
    const auto id = static_cast<std::int64_t>(job);
    for (const char* sql : {"DELETE FROM files WHERE job=?", "DELETE FROM job_blobs WHERE job=?",
                            "DELETE FROM frames WHERE job=?", "DELETE FROM jobs WHERE id=?"}) {
        Statement(database_, sql).bind(id).run();
    }
}

void JobQueue::set_frame(FrameKey key, v1::FrameState state, const v1::Error& error, std::int64_t not_before,
                         std::int64_t now_ms)
{
    Statement(database_,
              "UPDATE frames SET state=?, error_code=?, error=?, not_before=?, finished=? WHERE job=? AND idx=?")
        .bind(std::int64_t{state})
        .bind(std::int64_t{error.code()})
        .bind(error.message())
        .bind(not_before)
        .bind(now_ms)
        .bind(static_cast<std::int64_t>(key.job))
        .bind(std::int64_t{key.index})
        .run();
}

/// Brings the job's row up to date with its frames.
void JobQueue::settle(std::uint64_t job, std::int64_t now_ms)
{
    const auto id = static_cast<std::int64_t>(job);
    std::int64_t waiting = 0, active = 0, completed = 0, failed = 0, cancelled = 0;
    Statement counts(database_, "SELECT state, count(*) FROM frames WHERE job=? GROUP BY state");
    counts.bind(id);
    while (counts.step()) {
        switch (counts.integer(0)) {
            case v1::FRAME_STATE_ACTIVE:
                active = counts.integer(1);
                break;
            case v1::FRAME_STATE_COMPLETED:
                completed = counts.integer(1);
                break;
            case v1::FRAME_STATE_FAILED:
                failed = counts.integer(1);
                break;
            case v1::FRAME_STATE_CANCELLED:
                cancelled = counts.integer(1);
                break;
            default:
                waiting += counts.integer(1);
        }
    }
    Statement row(database_, "SELECT state FROM jobs WHERE id=?");
    row.bind(id).step();
    const bool asked = row.integer(0) == v1::JOB_STATE_CANCEL_REQUESTED;
    row.step();
    v1::JobState state = v1::JOB_STATE_QUEUED;
    if (waiting + active > 0) {
        state = asked                             ? v1::JOB_STATE_CANCEL_REQUESTED
                : active + completed + failed > 0 ? v1::JOB_STATE_RUNNING
                                                  : v1::JOB_STATE_QUEUED;
    } else if (cancelled > 0) {
        state = v1::JOB_STATE_CANCELLED;
    } else if (failed > 0) {
        state = v1::JOB_STATE_FAILED;
    } else {
        Statement warned(database_, "SELECT 1 FROM frames WHERE job=? AND warnings<>'' LIMIT 1");
        state = warned.bind(id).step() ? v1::JOB_STATE_COMPLETED_WITH_WARNINGS : v1::JOB_STATE_COMPLETED;
    }
    Statement(database_, "UPDATE jobs SET state=?, active=?, completed=?, failed=?, finished=? WHERE id=?")
        .bind(std::int64_t{state})
        .bind(active)
        .bind(completed)
        .bind(failed)
        .bind(has_ended(state) ? now_ms : std::int64_t{0})
        .bind(id)
        .run();
    if (failed > 0) {
        Statement(
            database_,
            "UPDATE jobs SET (error_code, error) = (SELECT error_code, error FROM frames WHERE job=?1 AND state=5 "
            "ORDER BY idx LIMIT 1) WHERE id=?1")
            .bind(id)
            .run();
    }
}

}  // namespace rcs::service
