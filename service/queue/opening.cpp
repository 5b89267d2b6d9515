// How a queue begins: with what an earlier server left.
#include "queue/job_queue.h"
#include "wire/errors.h"

namespace rcs::service {

JobQueue::JobQueue(const std::string& state, const QueueOptions& options, Moment now)
    : state_(state), marker_(prepare_queue(state, now)), database_(queue_path(state))
{
    set_options(options);
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
    load_share();
    for (const FrameKey& key : active_frames()) recover(key, now);
    look_after_waiting(now);
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

void JobQueue::set_options(const QueueOptions& options)
{
    options_ = options;
    share_.set_options(options.share);
}

/// What the rows say: at the start, and where changes were undone.
void JobQueue::load_share()
{
    Statement paused(database_, "SELECT 1 FROM meta WHERE name='paused'");
    paused_ = paused.step();
    std::set<std::uint64_t> gone = share_.jobs();
    Statement job(database_,
                  "SELECT id, owner, priority, paused OR waits>0, seconds, completed, entered FROM jobs WHERE ended=0");
    Statement count(database_,
                    "SELECT state, count(*), min(not_before) FROM frames WHERE job=? AND state IN (1, 2, 3) GROUP BY "
                    "state");
    while (job.step()) {
        const auto id = static_cast<std::uint64_t>(job.integer(0));
        gone.erase(id);
        share_.add(id, job.text(1), static_cast<int>(job.integer(2)), job.integer(3) != 0, job.integer(6));
        share_.set_history(id, job.real(4), job.integer(5));
        FairShare::Frames frames;
        count.bind(job.integer(0));
        while (count.step()) {
            const auto state = static_cast<v1::FrameState>(count.integer(0));
            (state == v1::FRAME_STATE_QUEUED   ? frames.queued
             : state == v1::FRAME_STATE_ACTIVE ? frames.active
                                               : frames.retried) = count.integer(1);
            if (state == v1::FRAME_STATE_SOFT_FAILED) frames.retry_ms = count.integer(2);
        }
        share_.set_frames(id, frames, job.integer(6));
    }
    for (const std::uint64_t ended : gone) share_.forget(ended);
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
        set_frame(key, v1::FRAME_STATE_CANCELLED, error_message(v1::ERROR_CODE_CANCELLED, reason_of_end(key.job)), 0,
                  now);
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

}  // namespace rcs::service
