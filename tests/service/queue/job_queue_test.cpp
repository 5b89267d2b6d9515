#include "queue/job_queue.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "queue/schema.h"

#include "support/temporary_folder.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::int64_t kStart = 1'000'000, kWall = 1'700'000'000'000;  // [ms]

/// Both clocks go alike, unless the wall's is set to something else.
Moment at(std::int64_t ms, std::int64_t ahead = 0) { return {kWall + ms + ahead, ms}; }

v1::Job job_of(int frames, int priority = 0, const std::string& key = {})
{
    v1::Job job;
    job.mutable_scene()->set_builtin("demo:cornell");
    job.mutable_scene()->set_label("cornell");
    job.add_outputs()->set_name("a.png");
    job.set_priority(priority);
    job.set_idempotency_key(key);
    for (int i = 0; i < frames; ++i) job.add_frames()->set_number(10 + i);
    return job;
}

class Queue : public ::testing::Test {
protected:
    std::uint64_t submit(const v1::Job& job, std::int64_t now = kStart)
    {
        const auto submitted = queue_->submit(job, "uid:1", "scene", {"blob"}, at(now));
        queue_->commit();
        return submitted.job;
    }
    FrameKey start_next(std::int64_t now = kStart)
    {
        const auto next = queue_->next(at(now));
        EXPECT_TRUE(next);
        queue_->start(next->key, "results/running", at(now));
        queue_->commit();
        return next->key;
    }
    void complete(FrameKey key, std::vector<std::string> warnings = {})
    {
        Completed result{"results/" + std::to_string(key.job), {}, "{}", std::move(warnings), 0.01};
        v1::OutputFile file;
        file.set_name("a.png");
        file.set_size(100);
        result.files.push_back(file);
        queue_->complete(key, result, at(kStart + 5));
        queue_->commit();
    }
    void fail(FrameKey key, Ending ending, std::int64_t now = kStart)
    {
        queue_->fail(key, ending, error_message(v1::ERROR_CODE_IO, "why"), at(now));
        queue_->commit();
    }
    v1::JobState state(std::uint64_t job) { return queue_->status(job)->state(); }
    /// As after kill -9: what was not committed is lost.
    void reopen(const QueueOptions& options = {})
    {
        queue_.reset();
        queue_.emplace(folder_.path(), options, at(kStart));
    }

    test::TemporaryFolder folder_;
    std::optional<JobQueue> queue_{std::in_place, folder_.path(), QueueOptions{}, at(kStart)};
};

TEST_F(Queue, AJobGoesThroughItsStates)
{
    const auto job = submit(job_of(2));
    EXPECT_EQ(state(job), v1::JOB_STATE_QUEUED);
    const FrameKey first = start_next();
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
    complete(first);
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
    complete(start_next());
    EXPECT_EQ(state(job), v1::JOB_STATE_COMPLETED);
    EXPECT_FALSE(queue_->next(at(kStart)));
    EXPECT_EQ(queue_->status(job)->frames_completed(), 2);
    EXPECT_EQ(queue_->file(first, "a.png")->second, "results/" + std::to_string(job) + "/a.png");
    EXPECT_FALSE(queue_->file(first, "b.png"));
}

TEST_F(Queue, WhatWasCommittedIsThereAfterAnEndWithoutWarning)
{
    const auto job = submit(job_of(3));
    complete(start_next());
    const FrameKey running = start_next();
    queue_->start(queue_->next(at(kStart))->key, "results/other", at(kStart));  // not committed
    reopen();
    EXPECT_EQ(queue_->active_frames().size(), 0u);
    EXPECT_EQ(queue_->status(job)->frames_completed(), 1);
    EXPECT_EQ(queue_->next(at(kStart))->key, running) << "what ran begins anew";
    EXPECT_EQ(queue_->count(v1::FRAME_STATE_QUEUED), 2u);
}

TEST_F(Queue, AFrameThatNeverEndsBeforeTheServerFailsInTheEnd)
{
    const auto job = submit(job_of(1));
    for (int i = 0; i < 3; ++i) {
        start_next();
        reopen({.max_starts = 3});
    }
    EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    EXPECT_NE(queue_->status(job)->error().message().find("started 3 times"), std::string::npos);
}

TEST_F(Queue, PriorityComesFirstThenOrderOfSubmission)
{
    const auto low = submit(job_of(1, 0)), second = submit(job_of(1, 0)), high = submit(job_of(1, 5));
    EXPECT_EQ(start_next().job, high);
    EXPECT_EQ(start_next().job, low);
    EXPECT_EQ(start_next().job, second);
}

TEST_F(Queue, WaitingRaisesPriority)
{
    const auto old = submit(job_of(1, 0), kStart);
    submit(job_of(1, 5), kStart + 6 * 600'000);  // six steps of ageing later
    EXPECT_EQ(start_next(kStart + 6 * 600'000).job, old);
}

TEST_F(Queue, AFailureThatMayPassIsTriedAgainLaterAndThenGivenUp)
{
    const auto job = submit(job_of(1));
    std::int64_t now = kStart;
    for (const std::int64_t wait : {1000, 4000}) {
        fail(start_next(now), Ending::may_pass, now);
        EXPECT_EQ(state(job), v1::JOB_STATE_QUEUED);
        EXPECT_FALSE(queue_->next(at(now + wait - 1)));
        EXPECT_EQ(queue_->next_retry_ms(), now + wait);
        now += wait;
    }
    fail(start_next(now), Ending::may_pass, now);
    EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    EXPECT_EQ(queue_->status(job)->error().message(), "why");
}

TEST_F(Queue, AFrameThatKillsItsWorkerTwiceFailsAndOthersGoOn)
{
    const auto bad = submit(job_of(1)), good = submit(job_of(1));
    fail(start_next(), Ending::died);
    complete(start_next());
    EXPECT_EQ(state(good), v1::JOB_STATE_COMPLETED);
    fail(start_next(kStart + 5000), Ending::died);
    EXPECT_EQ(state(bad), v1::JOB_STATE_FAILED);
}

TEST_F(Queue, AHopelessFrameFailsAtOnceAndTheJobKeepsItsOthers)
{
    const auto job = submit(job_of(2));
    fail(start_next(), Ending::failed);
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
    complete(start_next());
    EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    EXPECT_EQ(queue_->status(job)->frames_completed(), 1);
}

TEST_F(Queue, CancelEndsWaitingFramesAndLetsRunningOnesBeStopped)
{
    const auto job = submit(job_of(2));
    const FrameKey running = start_next();
    EXPECT_EQ(queue_->cancel(job, at(kStart)), v1::JOB_STATE_CANCEL_REQUESTED);
    queue_->commit();
    EXPECT_FALSE(queue_->next(at(kStart)));
    fail(running, Ending::may_pass);
    EXPECT_EQ(state(job), v1::JOB_STATE_CANCELLED);
    EXPECT_EQ(queue_->cancel(job, at(kStart)), v1::JOB_STATE_CANCELLED) << "once more changes nothing";
    EXPECT_EQ(queue_->cancel(777, at(kStart)), std::nullopt);
}

TEST_F(Queue, CancelSurvivesTheServer)
{
    const auto job = submit(job_of(2));
    start_next();
    queue_->cancel(job, at(kStart));
    queue_->commit();
    reopen();
    EXPECT_EQ(state(job), v1::JOB_STATE_CANCELLED);
}

TEST_F(Queue, AnIdempotencyKeyMakesOneJobForOneOwner)
{
    const auto job = submit(job_of(1, 0, "k"));
    const auto again = queue_->submit(job_of(1, 0, "k"), "uid:1", "scene", {}, at(kStart + 9));
    EXPECT_TRUE(again.existed);
    EXPECT_EQ(again.job, job);
    EXPECT_FALSE(queue_->submit(job_of(1, 0, "k"), "uid:2", "scene", {}, at(kStart)).existed);
    queue_->roll_back();
    try {
        queue_->submit(job_of(2, 0, "k"), "uid:1", "scene", {}, at(kStart));
        FAIL();
    } catch (const ServiceError& e) {
        EXPECT_EQ(e.code(), v1::ERROR_CODE_CONFLICT);
    }
}

TEST_F(Queue, LabelsInAnotherOrderAreTheSameJob)
{
    v1::Job a = job_of(1, 0, "k"), b = a;
    const std::string value = "x";
    for (int i = 0; i < 20; ++i) (*a.mutable_labels())[std::to_string(i)] = value;
    for (int i = 19; i >= 0; --i) (*b.mutable_labels())[std::to_string(i)] = value;
    submit(a);
    EXPECT_TRUE(queue_->submit(b, "uid:1", "scene", {}, at(kStart)).existed);
}

TEST_F(Queue, AFullQueueRefusesAndKeepsNothing)
{
    reopen({.max_unfinished_jobs = 2, .max_unfinished_frames = 10});
    submit(job_of(4));
    EXPECT_THROW(submit(job_of(7)), ServiceError);
    submit(job_of(6));
    EXPECT_THROW(submit(job_of(1)), ServiceError);
    EXPECT_EQ(queue_->count(v1::FRAME_STATE_QUEUED), 10u);
}

TEST_F(Queue, WarningsAreToldInTheEnd)
{
    const auto job = submit(job_of(1));
    complete(start_next(), {"textures ignored", "slow"});
    EXPECT_EQ(state(job), v1::JOB_STATE_COMPLETED_WITH_WARNINGS);
    v1::JobRequest request;
    request.set_job(job);
    const auto details = queue_->details(request);
    ASSERT_EQ(details.frames_size(), 1);
    EXPECT_EQ(details.frames(0).warnings_size(), 2);
    EXPECT_EQ(details.frames(0).number(), 10);
    EXPECT_EQ(details.frames(0).files(0).name(), "a.png");
    EXPECT_EQ(details.job().outputs(0).name(), "a.png");
}

TEST_F(Queue, ListsTheNewestFirstAndInPages)
{
    for (int i = 0; i < 5; ++i) submit(job_of(1));
    v1::ListRequest request;
    request.set_limit(2);
    auto page = queue_->list(request, "");
    ASSERT_EQ(page.jobs_size(), 2);
    EXPECT_TRUE(page.more());
    EXPECT_GT(page.jobs(0).job(), page.jobs(1).job());
    request.set_before(page.jobs(1).job());
    request.set_limit(10);
    page = queue_->list(request, "");
    EXPECT_EQ(page.jobs_size(), 3);
    EXPECT_FALSE(page.more());
    EXPECT_EQ(queue_->list(request, "uid:9").jobs_size(), 0);
}

TEST_F(Queue, ForgetsAJobWithAllThatBelongsToIt)
{
    const auto job = submit(job_of(1, 0, "k"));
    EXPECT_EQ(queue_->blobs_in_use(), std::set<std::string>{"blob"});
    complete(start_next());
    EXPECT_TRUE(queue_->blobs_in_use().empty());
    ASSERT_EQ(queue_->ended_jobs().size(), 1u);
    EXPECT_EQ(queue_->ended_jobs()[0].bytes, 100u);
    queue_->remove(job);
    queue_->commit();
    EXPECT_FALSE(queue_->status(job));
    EXPECT_TRUE(queue_->folders_in_use().empty());
    EXPECT_FALSE(queue_->submit(job_of(1, 0, "k"), "uid:1", "scene", {}, at(kStart)).existed);
}

TEST_F(Queue, CountsAreThoseThatCountingGives)
{
    const auto expect_counted = [&] {
        Database database(folder_ / "queue.db");
        for (int state = 1; state < v1::FrameState_ARRAYSIZE; ++state) {
            Statement row(database, "SELECT count(*) FROM frames WHERE state=?");
            row.bind(std::int64_t{state}).step();
            EXPECT_EQ(queue_->count(static_cast<v1::FrameState>(state)), static_cast<std::uint64_t>(row.integer(0)));
        }
        for (int state = 1; state < v1::JobState_ARRAYSIZE; ++state) {
            Statement row(database, "SELECT count(*) FROM jobs WHERE state=?");
            row.bind(std::int64_t{state}).step();
            EXPECT_EQ(queue_->count(static_cast<v1::JobState>(state)), static_cast<std::uint64_t>(row.integer(0)));
        }
    };
    const auto done = submit(job_of(1)), other = submit(job_of(4));
    complete(start_next());
    fail(start_next(), Ending::failed);
    fail(start_next(), Ending::may_pass);
    start_next();
    expect_counted();
    queue_->cancel(other, at(kStart));
    queue_->roll_back();
    expect_counted();
    queue_->cancel(other, at(kStart));
    queue_->remove(done);
    queue_->commit();
    expect_counted();
    reopen();
    expect_counted();
}

/// As long as it is open nobody else writes to its file: what it says after somebody did, it had not to look up.
TEST_F(Queue, CountsAreKeptAndSpecsAreParsedOnce)
{
    const auto job = submit(job_of(3));
    complete(start_next());
    {
        Database behind(folder_ / "queue.db");
        behind.run("UPDATE jobs SET spec=x'ff'");
        behind.run("DELETE FROM frames WHERE idx=2");
    }
    EXPECT_EQ(queue_->count(v1::FRAME_STATE_QUEUED), 2u);
    const auto next = queue_->next(at(kStart));
    ASSERT_TRUE(next && next->job);
    EXPECT_EQ(next->key.job, job);
    EXPECT_EQ(next->job->scene().builtin(), "demo:cornell");
}

TEST_F(Queue, TheWallsClockMovesNothing)
{
    constexpr std::int64_t kHour = 3'600'000, kCentury = std::int64_t{876'000} * kHour;
    for (const std::int64_t jump : {kHour, -kHour, -kWall, kCentury}) {
        const auto job = submit(job_of(1));
        queue_->start(queue_->next(at(kStart))->key, "results/a", at(kStart));
        queue_->fail({job, 0}, Ending::may_pass, error_message(v1::ERROR_CODE_IO, "why"), at(kStart, jump));
        EXPECT_FALSE(queue_->next(at(kStart + 999, jump)));
        ASSERT_TRUE(queue_->next(at(kStart + 1000, jump))) << jump;
        queue_->start({job, 0}, "results/b", at(kStart + 1000));
        queue_->complete({job, 0}, {"results/b", {}, "{}", {}, 0.0}, at(kStart + 3500, jump));
        queue_->commit();
        v1::JobRequest request;
        request.set_job(job);
        EXPECT_DOUBLE_EQ(queue_->details(request).frames(0).seconds(), 2.5) << jump;
        EXPECT_EQ(queue_->clock_ms(at(kStart + 3500, jump)) - queue_->ended_jobs().back().ended_ms, 0) << jump;
    }
    const auto first = submit(job_of(1));
    queue_->submit(job_of(1), "uid:1", "scene", {}, at(kStart + 1, -kWall));
    EXPECT_EQ(queue_->next(at(kStart + 2))->key.job, first) << "in the order of their coming";
}

TEST_F(Queue, ItsClockGoesOnWhereItWas)
{
    const std::int64_t before = queue_->clock_ms(at(kStart + 500));
    queue_->keep_clock(at(kStart + 500));
    queue_->commit();
    queue_.reset();
    constexpr std::int64_t kYear2100 = 4'102'444'800'000;
    queue_.emplace(folder_.path(), QueueOptions{}, Moment{kYear2100, 77});
    EXPECT_EQ(queue_->clock_ms({0, 77}), before) << "whatever the clocks say after another start of the machine";
}

TEST_F(Queue, AnOlderVersionsTablesAreBroughtUpToDate)
{
    queue_.reset();
    std::filesystem::remove_all(folder_ / "queue.db");
    std::filesystem::remove_all(folder_ / "marker");
    v1::Job spec = job_of(0);
    (*spec.mutable_labels())["shot"] = "s1";
    {
        Database database(folder_ / "queue.db");
        database.run(schema_steps()[0].c_str());
        database.run("PRAGMA user_version=1");
        Statement job(database,
                      "INSERT INTO jobs (id, owner, digest, spec, scene, scene_key, priority, state, submitted, "
                      "finished, frames, completed) VALUES (5, 'uid:1', '', ?, 's', 's', 0, 5, 1, 900, 1, 1)");
        job.bind_blob(spec.SerializeAsString()).run();
        database.run("INSERT INTO frames (job, idx, number, spec, state, rank) VALUES (5, 0, 0, '', 4, 0)");
    }
    reopen();
    EXPECT_EQ(queue_->status(5)->labels().at("shot"), "s1");
    EXPECT_EQ(queue_->count(v1::FRAME_STATE_COMPLETED), 1u);
    EXPECT_EQ(queue_->ended_jobs().at(0).ended_ms, 900);
    EXPECT_EQ(submit(job_of(1)), 6u);
    reopen();
    EXPECT_EQ(state(6), v1::JOB_STATE_QUEUED);
}

TEST_F(Queue, RefusesADatabaseOfAnotherVersion)
{
    queue_.reset();
    {
        Database database(folder_ / "queue.db");
        database.run("PRAGMA user_version=7");
    }
    EXPECT_THROW(reopen(), ServiceError);
}

}  // namespace
}  // namespace rcs::service
