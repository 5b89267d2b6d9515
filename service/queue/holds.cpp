// What users ask of jobs that are there: ends, pauses, retries; and what jobs do to those that wait for them.
#include <algorithm>
#include <cctype>

#include "queue/job_queue.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

std::string job_text(std::uint64_t job) { return "job " + std::to_string(job); }

bool is_completed(v1::JobState state)
{
    return state == v1::JOB_STATE_COMPLETED || state == v1::JOB_STATE_COMPLETED_WITH_WARNINGS;
}

/// Of a job that waits for one that has ended otherwise than completed.
v1::Error failure_of_dependent(const v1::JobStatus& done)
{
    std::string text = job_text(done.job()) + ", which it waits for, ";
    text += done.state() == v1::JOB_STATE_CANCELLED ? "was cancelled"
            : done.state() == v1::JOB_STATE_FAILED  ? "failed"
                                                    : "was lost with the queue's database";
    if (done.has_error()) text += ": " + done.error().message();
    constexpr std::size_t kLongest = 1000;  // a chain of them does not grow without end
    return error_message(v1::ERROR_CODE_DEPENDENCY, text.substr(0, kLongest));
}

/// Equal for failures that differ in numbers alone: "took 812 MB" and "took 813 MB".
std::string without_numbers(const v1::Error& error)
{
    std::string text = std::to_string(error.code()) + ":";
    for (const char c : error.message()) {
        const bool is_digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
        if (!is_digit || text.back() != '#') text += is_digit ? '#' : c;
    }
    return text;
}

}  // namespace

/// Ends frames that wait. @param failed  the job has, and `why` is the reason; else somebody cancelled it
void JobQueue::end_waiting(std::uint64_t job, const v1::Error& why, bool failed, Moment now)
{
    const auto id = static_cast<std::int64_t>(job);
    const v1::JobState before = status(job)->state();
    Statement(database_, "UPDATE jobs SET state=?, stop=? WHERE id=?")
        .bind(std::int64_t{v1::JOB_STATE_CANCEL_REQUESTED})
        .bind(failed ? why.message() : "")
        .bind(id)
        .run();
    if (failed) {
        Statement(database_, "UPDATE jobs SET error_code=?, error=? WHERE id=?")
            .bind(std::int64_t{why.code()})
            .bind(why.message())
            .bind(id)
            .run();
    }
    --tally_.jobs.at(before);
    ++tally_.jobs[v1::JOB_STATE_CANCEL_REQUESTED];
    for (const v1::FrameState waiting : {v1::FRAME_STATE_QUEUED, v1::FRAME_STATE_SOFT_FAILED}) {
        Statement(database_, "UPDATE frames SET state=?, finished=?, error_code=?, error=? WHERE job=? AND state=?")
            .bind(std::int64_t{v1::FRAME_STATE_CANCELLED})
            .bind(now.wall_ms)
            .bind(std::int64_t{v1::ERROR_CODE_CANCELLED})
            .bind(why.message())
            .bind(id)
            .bind(std::int64_t{waiting})
            .run();
        move_frames(job, waiting, v1::FRAME_STATE_CANCELLED, static_cast<std::uint64_t>(database_.changed()), now);
    }
}

/// Why frames of a job that is being ended are.
std::string JobQueue::reason_of_end(std::uint64_t job) const
{
    Statement row(database_, "SELECT stop FROM jobs WHERE id=?");
    row.bind(static_cast<std::int64_t>(job)).step();
    const std::string stop = row.text(0);
    return stop.empty() ? "cancelled" : stop;
}

std::optional<v1::JobState> JobQueue::cancel(std::uint64_t job, Moment now)
{
    const auto before = status(job);
    if (!before) return std::nullopt;
    if (has_ended(before->state()) || before->state() == v1::JOB_STATE_CANCEL_REQUESTED) return before->state();
    begin(Transaction::durable);
    end_waiting(job, error_message(v1::ERROR_CODE_CANCELLED, "cancelled"), false, now);
    settle(job, now);
    return status(job)->state();
}

/// A frame has failed for good: with too many of the same reason its job ends.
void JobQueue::count_failure(std::uint64_t job, const v1::Error& error, Moment now)
{
    const auto asked = spec(job);
    if (!asked || asked->stop_after() == 0) return;
    const std::string reason = without_numbers(error);
    const auto id = static_cast<std::int64_t>(job);
    Statement(database_,
              "INSERT INTO failures (job, reason, frames) VALUES (?, ?, 1) ON CONFLICT DO UPDATE SET frames=frames+1")
        .bind(id)
        .bind(reason)
        .run();
    Statement row(database_, "SELECT frames FROM failures WHERE job=? AND reason=?");
    row.bind(id).bind(reason).step();
    if (row.integer(0) < std::int64_t{asked->stop_after()}) return;
    const std::string text =
        "stopped after " + std::to_string(row.integer(0)) + " frames had failed alike: " + error.message();
    row.step();
    end_waiting(job, error_message(error.code(), text), true, now);
}

bool JobQueue::pause(std::uint64_t job, bool paused, Moment now)
{
    const auto id = static_cast<std::int64_t>(job);
    {
        Statement row(database_, "SELECT paused FROM jobs WHERE id=?");
        if (row.bind(id).step() && (row.integer(0) != 0) == paused) return false;
    }
    begin(Transaction::durable);
    Statement(database_, "UPDATE jobs SET paused=? WHERE id=?").bind(std::int64_t{paused}).bind(id).run();
    hold(job, now);
    settle(job, now);
    return true;
}

bool JobQueue::pause_all(bool paused)
{
    if (paused == paused_) return false;
    begin(Transaction::durable);
    database_.run(paused ? "INSERT INTO meta (name, value) VALUES ('paused', 1)"
                         : "DELETE FROM meta WHERE name='paused'");
    paused_ = paused;
    return true;
}

/// Tells those that share the workers whether this job's frames may start.
void JobQueue::hold(std::uint64_t job, Moment now)
{
    if (!share_.has(job)) return;
    Statement row(database_, "SELECT paused OR waits>0 FROM jobs WHERE id=?");
    row.bind(static_cast<std::int64_t>(job)).step();
    share_.set_held(job, row.integer(0) != 0, clock_ms(now));
}

int JobQueue::set_priority(std::uint64_t job, int priority, Moment now)
{
    const int before = status(job)->priority();
    if (before == priority) return before;
    begin(Transaction::durable);
    Statement(database_, "UPDATE jobs SET priority=? WHERE id=?")
        .bind(std::int64_t{priority})
        .bind(static_cast<std::int64_t>(job))
        .run();
    if (share_.has(job)) share_.set_priority(job, priority, clock_ms(now));
    return before;
}

std::size_t JobQueue::retry(std::uint64_t job, const std::vector<int>& numbers, Moment now)
{
    const v1::JobStatus before = *status(job);
    if (before.state() == v1::JOB_STATE_CANCEL_REQUESTED)
        throw ServiceError(v1::ERROR_CODE_CONFLICT, job_text(job) + " is being ended; try again once it has");
    for (const int number : numbers) {
        if (!index_of(job, number)) {
            throw ServiceError(v1::ERROR_CODE_NOT_FOUND, job_text(job) + " has no frame " + std::to_string(number));
        }
    }
    const auto id = static_cast<std::int64_t>(job);
    const auto most = static_cast<std::uint64_t>(before.frames_failed() + before.frames_cancelled());
    if (most == 0) return 0;
    check_room(has_ended(before.state()) ? 1 : 0, numbers.empty() ? most : numbers.size(), before.owner());
    const std::int64_t waits = unfinished_before(job);
    begin(Transaction::durable);
    if (!share_.has(job)) {
        share_.add(job, before.owner(), before.priority(), true, clock_ms(now));
        share_.set_history(job, before.busy_seconds(), before.frames_completed());
    }
    const std::int64_t frames = wait_again(job, numbers, now);
    if (frames == 0) {
        if (has_ended(before.state())) share_.forget(job);
        return 0;
    }
    Statement(database_, "DELETE FROM failures WHERE job=?").bind(id).run();
    Statement(database_, "UPDATE jobs SET stop='', waits=?, error_code=0, error='' WHERE id=?")
        .bind(waits)
        .bind(id)
        .run();
    Statement(database_,
              "UPDATE jobs SET (error_code, error)=(SELECT error_code, error FROM frames WHERE job=?1 AND state=5 "
              "ORDER BY idx LIMIT 1) WHERE id=?1 AND failed>0")
        .bind(id)
        .run();
    hold(job, now);
    settle(job, now);
    return static_cast<std::size_t>(frames);
}

/// @return how many frames that had failed or been cancelled wait
std::int64_t JobQueue::wait_again(std::uint64_t job, const std::vector<int>& numbers, Moment now)
{
    std::int64_t frames = 0;
    const auto move = [&](v1::FrameState from, std::optional<int> number) {
        Statement change(database_,
                         "UPDATE frames SET state=1, starts=0, tries=0, deaths=0, memory_limits=0, time_limits=0, "
                         "not_before=0, error_code=0, error='', finished=0 WHERE job=?1 AND state=?2 AND (?3 IS NULL "
                         "OR number=?3)");
        change.bind(static_cast<std::int64_t>(job)).bind(std::int64_t{from});
        number ? change.bind(std::int64_t{*number}) : change.bind_null();
        change.run();
        const int changed = database_.changed();
        move_frames(job, from, v1::FRAME_STATE_QUEUED, static_cast<std::uint64_t>(changed), now);
        frames += changed;
    };
    for (const v1::FrameState ended : {v1::FRAME_STATE_FAILED, v1::FRAME_STATE_CANCELLED}) {
        if (numbers.empty()) move(ended, std::nullopt);
        for (const int number : numbers) move(ended, number);
    }
    return frames;
}

/// Jobs that this one waits for and that have not ended.
/// @throws ServiceError conflict: one has ended otherwise than completed
std::int64_t JobQueue::unfinished_before(std::uint64_t job) const
{
    std::int64_t unfinished = 0;
    Statement row(database_,
                  "SELECT a.after, j.state FROM job_after a JOIN jobs j ON j.id=a.after WHERE a.job=? AND NOT a.done");
    row.bind(static_cast<std::int64_t>(job));
    while (row.step()) {
        const auto state = static_cast<v1::JobState>(row.integer(1));
        if (!has_ended(state)) ++unfinished;
        if (has_ended(state) && !is_completed(state)) {
            throw ServiceError(v1::ERROR_CODE_CONFLICT, job_text(static_cast<std::uint64_t>(row.integer(0))) +
                                                            ", which " + job_text(job) +
                                                            " waits for, has not completed; retry that first");
        }
    }
    return unfinished;
}

/// Jobs that wait for this one, which has ended, start or end as well.
void JobQueue::tell_those_that_wait(const v1::JobStatus& done, Moment now, std::vector<std::uint64_t>& ended)
{
    const std::uint64_t job = done.job();
    std::vector<std::uint64_t> waiting;
    {
        Statement row(database_, "SELECT a.job FROM job_after a JOIN jobs j ON j.id=a.job WHERE a.after=? AND ended=0");
        row.bind(static_cast<std::int64_t>(job));
        while (row.step()) waiting.push_back(static_cast<std::uint64_t>(row.integer(0)));
    }
    for (const std::uint64_t next : waiting) {
        if (is_completed(done.state())) {
            wait_no_longer(next, job, now);
        } else {
            end_waiting(next, failure_of_dependent(done), true, now);
            if (settle_one(next, now)) ended.push_back(next);
        }
    }
}

void JobQueue::wait_no_longer(std::uint64_t job, std::uint64_t after, Moment now)
{
    const auto id = static_cast<std::int64_t>(job);
    Statement(database_, "UPDATE job_after SET done=1 WHERE job=? AND after=? AND done=0")
        .bind(id)
        .bind(static_cast<std::int64_t>(after))
        .run();
    if (database_.changed() == 0) return;
    Statement(database_, "UPDATE jobs SET waits=waits-1 WHERE id=?").bind(id).run();
    hold(job, now);
}

/// Of jobs that wait for what has ended or is lost, where the server that saw it told them nothing.
void JobQueue::look_after_waiting(Moment now)
{
    std::vector<std::pair<std::uint64_t, bool>> ended;
    {
        Statement row(
            database_,
            "SELECT DISTINCT a.after, j.id IS NULL FROM jobs w JOIN job_after a ON a.job=w.id LEFT JOIN jobs j "
            "ON j.id=a.after WHERE w.ended=0 AND w.waits>0 AND NOT a.done AND (j.id IS NULL OR j.ended>0)");
        while (row.step()) ended.emplace_back(static_cast<std::uint64_t>(row.integer(0)), row.integer(1) != 0);
    }
    for (const auto& [job, is_lost] : ended) {
        std::vector<std::uint64_t> next;
        v1::JobStatus lost;
        lost.set_job(job);
        tell_those_that_wait(is_lost ? lost : *status(job), now, next);
        settle_after(std::move(next), now);
    }
}

/// Takes down which jobs this new one waits for. It ends at once where one of them has not completed.
void JobQueue::wait_for(std::uint64_t job, const v1::Job& asked, Moment now)
{
    std::int64_t waits = 0;
    std::optional<v1::JobStatus> failed;
    for (const std::uint64_t after : asked.after()) {
        const v1::JobStatus first = *status(after);
        const bool done = is_completed(first.state());
        waits += !done;
        if (has_ended(first.state()) && !done) failed = first;
        Statement(database_, "INSERT INTO job_after (job, after, done) VALUES (?, ?, ?)")
            .bind(static_cast<std::int64_t>(job))
            .bind(static_cast<std::int64_t>(after))
            .bind(std::int64_t{done})
            .run();
    }
    if (waits == 0) return;
    Statement(database_, "UPDATE jobs SET waits=? WHERE id=?").bind(waits).bind(static_cast<std::int64_t>(job)).run();
    hold(job, now);
    if (!failed) return;
    end_waiting(job, failure_of_dependent(*failed), true, now);
    settle(job, now);
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
          "DELETE FROM failures WHERE job=?", "DELETE FROM job_after WHERE job=?", "DELETE FROM frames WHERE job=?",
          "DELETE FROM jobs WHERE id=?"}) {
        Statement(database_, sql).bind(id).run();
    }
    specs_.erase(job);
}

}  // namespace rcs::service
