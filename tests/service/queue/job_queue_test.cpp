#include "queue/job_queue.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr std::int64_t kStart = 1'000'000;  // [ms]

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
        const auto submitted = queue_->submit(job, "uid:1", "scene", {"blob"}, now);
        queue_->commit();
        return submitted.job;
    }
    FrameKey start_next(std::int64_t now = kStart)
    {
        const auto next = queue_->next(now);
        EXPECT_TRUE(next);
        queue_->start(next->key, now);
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
        queue_->complete(key, result, kStart + 5);
        queue_->commit();
    }
    void fail(FrameKey key, Ending ending, std::int64_t now = kStart)
    {
        queue_->fail(key, ending, error_message(v1::ERROR_CODE_IO, "why"), now);
        queue_->commit();
    }
    v1::JobState state(std::uint64_t job) { return queue_->status(job)->state(); }
    /// As after kill -9: what was not committed is lost.
    void reopen(const QueueOptions& options = {})
    {
        queue_.reset();
        queue_.emplace(folder_ / "queue.db", options, kStart);
    }

    test::TemporaryFolder folder_;
    std::optional<JobQueue> queue_{std::in_place, folder_ / "queue.db", QueueOptions{}, kStart};
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
    EXPECT_FALSE(queue_->next(kStart));
    EXPECT_EQ(queue_->status(job)->frames_completed(), 2);
    EXPECT_EQ(queue_->file(first, "a.png")->second, "results/" + std::to_string(job) + "/a.png");
    EXPECT_FALSE(queue_->file(first, "b.png"));
}

TEST_F(Queue, WhatWasCommittedIsThereAfterAnEndWithoutWarning)
{
    const auto job = submit(job_of(3));
    complete(start_next());
    const FrameKey running = start_next();
    queue_->start(queue_->next(kStart)->key, kStart);  // not committed
    reopen();
    EXPECT_EQ(queue_->active_frames().size(), 0u);
    EXPECT_EQ(queue_->status(job)->frames_completed(), 1);
    EXPECT_EQ(queue_->next(kStart)->key, running) << "what ran begins anew";
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
        EXPECT_FALSE(queue_->next(now + wait - 1));
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
    EXPECT_EQ(queue_->cancel(job, kStart), v1::JOB_STATE_CANCEL_REQUESTED);
    queue_->commit();
    EXPECT_FALSE(queue_->next(kStart));
    fail(running, Ending::may_pass);
    EXPECT_EQ(state(job), v1::JOB_STATE_CANCELLED);
    EXPECT_EQ(queue_->cancel(job, kStart), v1::JOB_STATE_CANCELLED) << "once more changes nothing";
    EXPECT_EQ(queue_->cancel(777, kStart), std::nullopt);
}

TEST_F(Queue, CancelSurvivesTheServer)
{
    const auto job = submit(job_of(2));
    start_next();
    queue_->cancel(job, kStart);
    queue_->commit();
    reopen();
    EXPECT_EQ(state(job), v1::JOB_STATE_CANCELLED);
}

TEST_F(Queue, AnIdempotencyKeyMakesOneJobForOneOwner)
{
    const auto job = submit(job_of(1, 0, "k"));
    const auto again = queue_->submit(job_of(1, 0, "k"), "uid:1", "scene", {}, kStart + 9);
    EXPECT_TRUE(again.existed);
    EXPECT_EQ(again.job, job);
    EXPECT_FALSE(queue_->submit(job_of(1, 0, "k"), "uid:2", "scene", {}, kStart).existed);
    queue_->roll_back();
    try {
        queue_->submit(job_of(2, 0, "k"), "uid:1", "scene", {}, kStart);
        FAIL();
    } catch (const ServiceError& e) {
        EXPECT_EQ(e.code(), v1::ERROR_CODE_CONFLICT);
    }
}

TEST_F(Queue, LabelsInAnotherOrderAreTheSameJob)
{
    v1::Job a = job_of(1, 0, "k"), b = a;
    for (int i = 0; i < 20; ++i) (*a.mutable_labels())[std::to_string(i)] = "x";
    for (int i = 19; i >= 0; --i) (*b.mutable_labels())[std::to_string(i)] = "x";
    submit(a);
    EXPECT_TRUE(queue_->submit(b, "uid:1", "scene", {}, kStart).existed);
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
    EXPECT_FALSE(queue_->submit(job_of(1, 0, "k"), "uid:1", "scene", {}, kStart).existed);
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
