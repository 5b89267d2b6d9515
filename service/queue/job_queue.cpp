// What changes the queue; submit.cpp adds to it, job_rows.cpp reads it.
#include "queue/job_queue.h"

#include <algorithm>
#include <cmath>

#include "wire/errors.h"

namespace rcs::service {
namespace {

// As the tables of queue/schema.h have them.
static_assert(v1::FRAME_STATE_QUEUED == 1 && v1::FRAME_STATE_ACTIVE == 2 && v1::FRAME_STATE_SOFT_FAILED == 3);

constexpr double kLongestBackoff = 300.0;  // [s]

}  // namespace

bool has_ended(v1::JobState state)
{
    return state == v1::JOB_STATE_CANCELLED || state == v1::JOB_STATE_COMPLETED ||
           state == v1::JOB_STATE_COMPLETED_WITH_WARNINGS || state == v1::JOB_STATE_FAILED;
}

v1::JobState state_of(const FrameCounts& c, bool cancel, bool warned)
{
    if (c.waiting + c.active > 0) {
        return cancel                                  ? v1::JOB_STATE_CANCEL_REQUESTED
               : c.active + c.completed + c.failed > 0 ? v1::JOB_STATE_RUNNING
                                                       : v1::JOB_STATE_QUEUED;
    }
    if (c.cancelled > 0) return v1::JOB_STATE_CANCELLED;
    if (c.failed > 0) return v1::JOB_STATE_FAILED;
    return warned ? v1::JOB_STATE_COMPLETED_WITH_WARNINGS : v1::JOB_STATE_COMPLETED;
}

JobQueue::JobQueue(const std::string& state, const QueueOptions& options, Moment now)
    : state_(state), marker_(prepare_queue(state, now)), database_(queue_path(state)), options_(options)
{
    database_.run(
        "PRAGMA journal_mode=WAL; PRAGMA foreign_keys=ON; PRAGMA temp_store=MEMORY; PRAGMA "
        "journal_size_limit=16777216");
    {
        Statement clock(database_, "SELECT value FROM meta WHERE name='clock'");
        clock_begin_ms_ = (clock.step() ? clock.integer(0) : now.wall_ms) - now.steady_ms;
    }
    begin(Transaction::durable);
    count_all();
    // The steady clock is another one after each start of the machine.
    database_.run("UPDATE frames SET not_before=0 WHERE state=3");
    for (const FrameKey& key : active_frames()) recover(key, now);
    keep_clock(now);
    commit();
}

void JobQueue::count_all()
{
    Statement frames(database_, "SELECT state, count(*) FROM frames GROUP BY state");
    while (frames.step()) {
        tally_.frames.at(static_cast<std::size_t>(frames.integer(0))) = static_cast<std::uint64_t>(frames.integer(1));
    }
    Statement jobs(database_, "SELECT state, count(*) FROM jobs GROUP BY state");
    while (jobs.step()) {
        tally_.jobs.at(static_cast<std::size_t>(jobs.integer(0))) = static_cast<std::uint64_t>(jobs.integer(1));
    }
}

/// A frame that ran when the server ended.
void JobQueue::recover(FrameKey key, Moment now)
{
    const auto job = static_cast<std::int64_t>(key.job);
    std::int64_t starts = 0;
    bool cancelled = false;
    {
        Statement row(
            database_,
            "SELECT f.starts, j.state, f.folder FROM frames f JOIN jobs j ON j.id=f.job WHERE f.job=? AND f.idx=?");
        row.bind(job).bind(std::int64_t{key.index}).step();
        starts = row.integer(0);
        cancelled = row.integer(1) == v1::JOB_STATE_CANCEL_REQUESTED;
        if (!row.text(2).empty()) unfinished_folders_.push_back(row.text(2));
    }
    if (cancelled) {
        set_frame(key, v1::FRAME_STATE_CANCELLED, error_message(v1::ERROR_CODE_CANCELLED, "cancelled"), 0, now);
    } else if (starts >= options_.max_starts) {
        set_frame(key, v1::FRAME_STATE_FAILED,
                  error_message(v1::ERROR_CODE_WORKER_DIED, "was started " + std::to_string(starts) +
                                                                " times, and the server ended each time before it did"),
                  0, now);
    } else {
        set_frame(key, v1::FRAME_STATE_QUEUED, {}, 0, now);
    }
    settle(key.job, now);
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
    try {
        database_.run("ROLLBACK");
    } catch (const ServiceError&) {
        // SQLite has rolled back by itself, as it does on a full disk.
    }
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
    Statement(database_, "UPDATE jobs SET started=? WHERE id=? AND started=0").bind(now.wall_ms).bind(job).run();
    started_ms_[key] = now.steady_ms;
    settle(key.job, now);
}

void JobQueue::complete(FrameKey key, const Completed& result, Moment now)
{
    begin(Transaction::durable);
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    std::string warnings;
    for (const std::string& line : result.warnings) warnings += line + "\n";
    set_frame(key, v1::FRAME_STATE_COMPLETED, {}, 0, now);
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
    settle(key.job, now);
}

void JobQueue::fail(FrameKey key, Ending ending, const v1::Error& error, Moment now)
{
    begin(Transaction::durable);
    const auto job = static_cast<std::int64_t>(key.job);
    const std::int64_t index = key.index;
    if (is_cancelled(key.job)) {
        set_frame(key, v1::FRAME_STATE_CANCELLED, error_message(v1::ERROR_CODE_CANCELLED, "cancelled"), 0, now);
        settle(key.job, now);
        return;
    }
    if (ending == Ending::no_room) return give_back(key, now);
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
              again ? now.steady_ms + std::llround(1e3 * wait) : 0, now);
    settle(key.job, now);
}

std::optional<v1::JobState> JobQueue::cancel(std::uint64_t job, Moment now)
{
    const auto before = status(job);
    if (!before) return std::nullopt;
    if (has_ended(before->state())) return before->state();
    begin(Transaction::durable);
    const auto id = static_cast<std::int64_t>(job);
    for (const v1::FrameState waiting : {v1::FRAME_STATE_QUEUED, v1::FRAME_STATE_SOFT_FAILED}) {
        Statement(database_,
                  "UPDATE frames SET state=?, finished=?, error_code=?, error='cancelled' WHERE job=? AND state=?")
            .bind(std::int64_t{v1::FRAME_STATE_CANCELLED})
            .bind(now.wall_ms)
            .bind(std::int64_t{v1::ERROR_CODE_CANCELLED})
            .bind(id)
            .bind(std::int64_t{waiting})
            .run();
        move_frames(job, waiting, v1::FRAME_STATE_CANCELLED, static_cast<std::uint64_t>(database_.changed()));
    }
    Statement(database_, "UPDATE jobs SET state=? WHERE id=?")
        .bind(std::int64_t{v1::JOB_STATE_CANCEL_REQUESTED})
        .bind(id)
        .run();
    --tally_.jobs[before->state()];
    ++tally_.jobs[v1::JOB_STATE_CANCEL_REQUESTED];
    settle(job, now);
    return status(job)->state();
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

void JobQueue::remove(std::uint64_t job)
{
    begin(Transaction::durable);
    const auto id = static_cast<std::int64_t>(job);
    {
        Statement row(database_, "SELECT state, completed, failed, cancelled FROM jobs WHERE id=?");
        if (!row.bind(id).step()) return;
        --tally_.jobs.at(static_cast<std::size_t>(row.integer(0)));
        tally_.frames[v1::FRAME_STATE_COMPLETED] -= static_cast<std::uint64_t>(row.integer(1));
        tally_.frames[v1::FRAME_STATE_FAILED] -= static_cast<std::uint64_t>(row.integer(2));
        tally_.frames[v1::FRAME_STATE_CANCELLED] -= static_cast<std::uint64_t>(row.integer(3));
    }
    for (const char* sql :
         {"DELETE FROM files WHERE job=?", "DELETE FROM job_blobs WHERE job=?", "DELETE FROM labels WHERE job=?",
          "DELETE FROM frames WHERE job=?", "DELETE FROM jobs WHERE id=?"}) {
        Statement(database_, sql).bind(id).run();
    }
    specs_.erase(job);
}

void JobQueue::set_frame(FrameKey key, v1::FrameState state, const v1::Error& error, std::int64_t not_before,
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
    const auto started = started_ms_.extract(key);
    const bool ends = state != v1::FRAME_STATE_QUEUED && state != v1::FRAME_STATE_ACTIVE;
    Statement(database_,
              "UPDATE frames SET state=?1, error_code=?2, error=?3, not_before=?4, folder='', finished=?5, "
              "started=CASE WHEN ?6<0 THEN started ELSE ?5-?6 END WHERE job=?7 AND idx=?8")
        .bind(std::int64_t{state})
        .bind(std::int64_t{error.code()})
        .bind(error.message())
        .bind(not_before)
        .bind(ends ? now.wall_ms : std::int64_t{0})
        .bind(started && ends ? now.steady_ms - started.mapped() : std::int64_t{-1})
        .bind(job)
        .bind(index)
        .run();
    move_frames(key.job, before, state, 1);
    if (state == v1::FRAME_STATE_FAILED) {
        Statement(database_, "UPDATE jobs SET error_code=?, error=? WHERE id=? AND error_code=0")
            .bind(std::int64_t{error.code()})
            .bind(error.message())
            .bind(job)
            .run();
    }
}

/// Keeps the counts of the job's row, and of all jobs.
void JobQueue::move_frames(std::uint64_t job, v1::FrameState from, v1::FrameState to, std::uint64_t count)
{
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
}

/// Brings the job's state up to date with its counts.
void JobQueue::settle(std::uint64_t job, Moment now)
{
    const auto id = static_cast<std::int64_t>(job);
    FrameCounts counts;
    v1::JobState before{};
    {
        Statement row(database_, "SELECT state, frames, active, completed, failed, cancelled FROM jobs WHERE id=?");
        row.bind(id).step();
        before = static_cast<v1::JobState>(row.integer(0));
        counts = {0, row.integer(2), row.integer(3), row.integer(4), row.integer(5)};
        counts.waiting = row.integer(1) - counts.active - counts.completed - counts.failed - counts.cancelled;
    }
    bool warned = false;
    if (counts.completed > 0 && counts.waiting + counts.active == 0) {
        Statement row(database_, "SELECT 1 FROM frames WHERE job=? AND warnings<>'' LIMIT 1");
        warned = row.bind(id).step();
    }
    const v1::JobState state = state_of(counts, before == v1::JOB_STATE_CANCEL_REQUESTED, warned);
    if (state == before) return;
    Statement(database_, "UPDATE jobs SET state=?, finished=?, ended=? WHERE id=?")
        .bind(std::int64_t{state})
        .bind(has_ended(state) ? now.wall_ms : std::int64_t{0})
        .bind(has_ended(state) ? clock_ms(now) : std::int64_t{0})
        .bind(id)
        .run();
    --tally_.jobs.at(before);
    ++tally_.jobs.at(state);
}

}  // namespace rcs::service
