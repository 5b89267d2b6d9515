// What frames' starts and ends change; submit.cpp adds jobs, holds.cpp does what users ask for, job_rows.cpp reads.
#include "queue/job_queue.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "wire/errors.h"

namespace rcs::service {
namespace {

// As the tables of queue/schema.h have them.
static_assert(v1::FRAME_STATE_QUEUED == 1 && v1::FRAME_STATE_ACTIVE == 2 && v1::FRAME_STATE_SOFT_FAILED == 3);

constexpr double kLongestBackoff = 300.0;  // [s]

}  // namespace

Ending ending_of(v1::ErrorCode code)
{
    switch (code) {
        case v1::ERROR_CODE_IO:
        case v1::ERROR_CODE_GL_UNAVAILABLE:
        case v1::ERROR_CODE_INTERNAL:
        case v1::ERROR_CODE_CANCELLED:  // by nobody: a job that somebody ended tries nothing again
            return Ending::may_pass;
        case v1::ERROR_CODE_OUT_OF_MEMORY:
        case v1::ERROR_CODE_MEMORY_LIMIT:
            return Ending::over_memory;
        case v1::ERROR_CODE_TIME_LIMIT:
            return Ending::over_time;
        case v1::ERROR_CODE_WORKER_DIED:
            return Ending::died;
        case v1::ERROR_CODE_UNAVAILABLE:
            return Ending::no_room;
        default:
            return Ending::failed;
    }
}

bool has_ended(v1::JobState state)
{
    return state == v1::JOB_STATE_CANCELLED || state == v1::JOB_STATE_COMPLETED ||
           state == v1::JOB_STATE_COMPLETED_WITH_WARNINGS || state == v1::JOB_STATE_FAILED;
}

v1::JobState state_of(const FrameCounts& c, const JobTraits& traits)
{
    if (c.waiting + c.active > 0) {
        return traits.cancel                           ? v1::JOB_STATE_CANCEL_REQUESTED
               : traits.paused                         ? v1::JOB_STATE_PAUSED
               : c.active + c.completed + c.failed > 0 ? v1::JOB_STATE_RUNNING
                                                       : v1::JOB_STATE_QUEUED;
    }
    if (traits.stopped) return v1::JOB_STATE_FAILED;
    if (c.cancelled > 0) return v1::JOB_STATE_CANCELLED;
    if (c.failed > 0) return v1::JOB_STATE_FAILED;
    return traits.warned ? v1::JOB_STATE_COMPLETED_WITH_WARNINGS : v1::JOB_STATE_COMPLETED;
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
    committed_ = tally_;
}

void JobQueue::roll_back()
{
    if (transaction_ == Transaction::none) return;
    transaction_ = Transaction::none;
    tally_ = committed_;
    specs_.clear();
    changed_.clear();
    try {
        database_.run("ROLLBACK");
    } catch (const ServiceError&) {
        // SQLite has rolled back by itself, as it does on a full disk.
    }
    load_share();
}

void JobQueue::keep_clock(Moment now)
{
    begin(Transaction::plain);
    Statement(database_, "UPDATE meta SET value=? WHERE name='clock'").bind(clock_ms(now)).run();
}

void JobQueue::start(FrameKey key, const std::string& folder, Moment now)
{
    begin(Transaction::plain);
    const auto job = static_cast<std::int64_t>(key.job);
    set_frame(key, v1::FRAME_STATE_ACTIVE, {}, 0, now);
    Statement(database_, "UPDATE frames SET starts=starts+1, started=?, folder=? WHERE job=? AND idx=?")
        .bind(now.wall_ms)
        .bind(folder)
        .bind(job)
        .bind(std::int64_t{key.index})
        .run();
    Statement(database_, "UPDATE jobs SET started=?, waited=?-entered WHERE id=? AND started=0")
        .bind(now.wall_ms)
        .bind(clock_ms(now))
        .bind(job)
        .run();
    running_[key] = {now.steady_ms, share_.begin(key.job, clock_ms(now))};
    settle(key.job, now);
}

void JobQueue::complete(FrameKey key, const Completed& result, Moment now)
{
    begin(Transaction::durable);
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    std::string warnings;
    for (const std::string& line : result.warnings) warnings += line + "\n";
    const double seconds = set_frame(key, v1::FRAME_STATE_COMPLETED, {}, 0, now);
    const auto bytes = std::accumulate(result.files.begin(), result.files.end(), std::uint64_t{0},
                                       [](std::uint64_t sum, const auto& file) { return sum + file.size(); });
    Statement(database_, "UPDATE jobs SET seconds=seconds+?, estimate=estimate+?, bytes=bytes+? WHERE id=?")
        .bind(seconds)
        .bind(result.error_estimate)
        .bind(static_cast<std::int64_t>(bytes))
        .bind(job)
        .run();
    const auto asked = spec(key.job);
    Statement(database_,
              "UPDATE frames SET folder=?, delivery=?, estimate=?, stats=?, warnings=? WHERE job=? AND idx=?")
        .bind(result.folder)
        .bind(std::int64_t{asked && !asked->deliver().empty()})
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
    settle(key.job, now);
}

void JobQueue::fail(FrameKey key, Ending ending, const v1::Error& error, Moment now)
{
    begin(Transaction::durable);
    if (is_cancelled(key.job)) {
        const auto why = error_message(v1::ERROR_CODE_CANCELLED, reason_of_end(key.job));
        set_frame(key, v1::FRAME_STATE_CANCELLED, why, 0, now);
        settle(key.job, now);
        return;
    }
    if (ending == Ending::no_room) return give_back(key, now);
    double wait = 0.0;
    const bool again = may_try_again(key, ending, wait);
    set_frame(key, again ? v1::FRAME_STATE_SOFT_FAILED : v1::FRAME_STATE_FAILED, error,
              again ? now.steady_ms + std::llround(1e3 * wait) : 0, now);
    if (!again) count_failure(key.job, error, now);
    settle(key.job, now);
}

/// Counts a try that failed. @param wait  before the next one [s]
bool JobQueue::may_try_again(FrameKey key, Ending ending, double& wait)
{
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    Statement(database_,
              "UPDATE frames SET tries=tries+1, deaths=deaths+?, memory_limits=memory_limits+?, "
              "time_limits=time_limits+? WHERE job=? AND idx=?")
        .bind(std::int64_t{ending == Ending::died})
        .bind(std::int64_t{ending == Ending::over_memory})
        .bind(std::int64_t{ending == Ending::over_time})
        .bind(job)
        .bind(index)
        .run();
    Statement row(database_,
                  "SELECT tries-deaths-memory_limits-time_limits, deaths, memory_limits, time_limits, starts FROM "
                  "frames WHERE job=? AND idx=?");
    row.bind(job).bind(index).step();
    const RetryPolicy& policy = ending == Ending::died          ? options_.death
                                : ending == Ending::over_memory ? options_.memory
                                : ending == Ending::over_time   ? options_.time
                                                                : options_.passing;
    const auto failed_so = row.integer(&policy == &options_.death    ? 1
                                       : &policy == &options_.memory ? 2
                                       : &policy == &options_.time   ? 3
                                                                     : 0);
    wait = std::min(kLongestBackoff, policy.wait_seconds * std::pow(4.0, static_cast<double>(failed_so - 1)));
    return ending != Ending::failed && failed_so < policy.tries && row.integer(4) < options_.max_starts;
}

void JobQueue::give_back(FrameKey key, Moment now)
{
    begin(Transaction::plain);
    set_frame(key, v1::FRAME_STATE_QUEUED, {}, 0, now);
    Statement(database_, "UPDATE frames SET starts=starts-1 WHERE job=? AND idx=?")
        .bind(static_cast<std::int64_t>(key.job))
        .bind(std::int64_t{key.index})
        .run();
    settle(key.job, now);
}

/// @return how long it ran, where it did [s]
double JobQueue::set_frame(FrameKey key, v1::FrameState state, const v1::Error& error, std::int64_t not_before,
                           Moment now)
{
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    v1::FrameState before{};
    {
        Statement row(database_, "SELECT state FROM frames WHERE job=? AND idx=?");
        row.bind(job).bind(index).step();
        before = static_cast<v1::FrameState>(row.integer(0));
    }
    // When it started is said such that it took as long as it did, wherever the wall's clock was set meanwhile.
    const auto ran = running_.extract(key);
    const std::int64_t ran_ms = ran ? now.steady_ms - ran.mapped().started_ms : -1;
    const bool ends = state != v1::FRAME_STATE_QUEUED && state != v1::FRAME_STATE_ACTIVE;
    Statement(database_,
              "UPDATE frames SET state=?1, error_code=?2, error=?3, not_before=?4, folder='', finished=?5, "
              "started=CASE WHEN ?6<0 THEN started ELSE ?5-?6 END WHERE job=?7 AND idx=?8")
        .bind(std::int64_t{state})
        .bind(std::int64_t{error.code()})
        .bind(error.message())
        .bind(not_before)
        .bind(ends ? now.wall_ms : std::int64_t{0})
        .bind(ends ? ran_ms : std::int64_t{-1})
        .bind(job)
        .bind(index)
        .run();
    const double seconds = 1e-3 * static_cast<double>(std::max(std::int64_t{0}, ran_ms));
    if (ran) share_.end(key.job, seconds, ran.mapped().charged, state == v1::FRAME_STATE_COMPLETED);
    move_frames(key.job, before, state, 1, now);
    if (state == v1::FRAME_STATE_FAILED) {
        Statement(database_, "UPDATE jobs SET error_code=?, error=? WHERE id=? AND error_code=0")
            .bind(std::int64_t{error.code()})
            .bind(error.message())
            .bind(job)
            .run();
    }
    return seconds;
}

/// Keeps the counts of the job's row, of all jobs, and of those that share the workers.
void JobQueue::move_frames(std::uint64_t job, v1::FrameState from, v1::FrameState to, std::uint64_t count, Moment now)
{
    if (count == 0) return;
    tally_.frames.at(from) -= count;
    tally_.frames.at(to) += count;
    const auto change = [&](v1::FrameState state) {
        return static_cast<std::int64_t>(count) * ((to == state) - (from == state));
    };
    Statement(
        database_,
        "UPDATE jobs SET active=active+?, completed=completed+?, failed=failed+?, cancelled=cancelled+? WHERE id=?")
        .bind(change(v1::FRAME_STATE_ACTIVE))
        .bind(change(v1::FRAME_STATE_COMPLETED))
        .bind(change(v1::FRAME_STATE_FAILED))
        .bind(change(v1::FRAME_STATE_CANCELLED))
        .bind(static_cast<std::int64_t>(job))
        .run();
    FairShare::Frames frames = share_.frames(job);
    frames.queued += change(v1::FRAME_STATE_QUEUED);
    frames.active += change(v1::FRAME_STATE_ACTIVE);
    frames.retried += change(v1::FRAME_STATE_SOFT_FAILED);
    if (frames.retried > 0) {
        Statement first(database_, "SELECT min(not_before) FROM frames WHERE job=? AND state=3");
        first.bind(static_cast<std::int64_t>(job)).step();
        frames.retry_ms = first.integer(0);
    }
    share_.set_frames(job, frames, clock_ms(now));
}

/// Brings the job's state up to date with its counts. @return it has just ended
bool JobQueue::settle_one(std::uint64_t job, Moment now)
{
    const auto id = static_cast<std::int64_t>(job);
    FrameCounts counts;
    JobTraits traits;
    v1::JobState before{};
    {
        Statement row(database_,
                      "SELECT state, frames, active, completed, failed, cancelled, stop<>'', paused FROM jobs WHERE "
                      "id=?");
        row.bind(id).step();
        before = static_cast<v1::JobState>(row.integer(0));
        counts = {0, row.integer(2), row.integer(3), row.integer(4), row.integer(5)};
        counts.waiting = row.integer(1) - counts.active - counts.completed - counts.failed - counts.cancelled;
        traits = {before == v1::JOB_STATE_CANCEL_REQUESTED, row.integer(6) != 0, row.integer(7) != 0, false};
    }
    if (counts.completed > 0 && counts.waiting + counts.active == 0) {
        Statement row(database_, "SELECT 1 FROM frames WHERE job=? AND warnings<>'' LIMIT 1");
        traits.warned = row.bind(id).step();
    }
    const v1::JobState state = state_of(counts, traits);
    if (state == before) return false;
    changed_.push_back(job);
    const bool ended = has_ended(state);
    Statement(database_, "UPDATE jobs SET state=?, finished=?, ended=?, announce=? WHERE id=?")
        .bind(std::int64_t{state})
        .bind(ended ? now.wall_ms : std::int64_t{0})
        .bind(ended ? clock_ms(now) : std::int64_t{0})
        .bind(std::int64_t{ended && options_.announces_ends})
        .bind(id)
        .run();
    --tally_.jobs.at(before);
    ++tally_.jobs.at(state);
    if (ended) share_.forget(job);
    return ended;
}

void JobQueue::settle(std::uint64_t job, Moment now)
{
    if (settle_one(job, now)) settle_after({job}, now);
}

/// Jobs that wait for those that have ended start, or end as well.
void JobQueue::settle_after(std::vector<std::uint64_t> ended, Moment now)
{
    while (!ended.empty()) {
        const v1::JobStatus done = *status(ended.back());
        ended.pop_back();
        tell_those_that_wait(done, now, ended);
    }
}

}  // namespace rcs::service
