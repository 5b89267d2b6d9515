// What users ask of jobs in the queue, and what jobs do to those that wait for them.
#include <filesystem>

#include <gtest/gtest.h>

#include "queue/job_queue.h"
#include "support/temporary_folder.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

v1::Job job_of(int frames)
{
    v1::Job job;
    job.mutable_scene()->set_builtin("demo:cornell");
    for (int i = 0; i < frames; ++i) job.add_frames()->set_number(10 + i);
    return job;
}

class Holds : public ::testing::Test {
protected:
    std::uint64_t submit(const v1::Job& job, const std::string& owner = "uid:1")
    {
        const auto number = queue_->submit(job, owner, "scene", {}, now_).job;
        queue_->commit();
        return number;
    }
    FrameKey start()
    {
        const auto next = queue_->next(now_);
        EXPECT_TRUE(next);
        if (next) queue_->start(next->key, "results/x", now_);
        return next ? next->key : FrameKey();
    }
    void fail(Ending ending, const std::string& why = "why")
    {
        queue_->fail(start(), ending, error_message(v1::ERROR_CODE_BAD_FILE, why), now_);
        queue_->commit();
    }
    void complete()
    {
        queue_->complete(start(), {"results/x", {}, "{}", {}, 0.02}, now_);
        queue_->commit();
    }
    v1::JobState state(std::uint64_t job) { return queue_->status(job)->state(); }
    bool anything_next() { return queue_->next(now_).has_value(); }
    void reopen(const QueueOptions& options = {})
    {
        queue_.reset();
        queue_.emplace(folder_.path(), options, now_);
    }
    void pass(std::int64_t ms)
    {
        now_.steady_ms += ms;
        now_.wall_ms += ms;
    }
    v1::ErrorCode code_of_retry(std::uint64_t job, const std::vector<int>& frames)
    {
        try {
            queue_->retry(job, frames, now_);
        } catch (const ServiceError& e) {
            return e.code();
        }
        return v1::ERROR_CODE_UNSPECIFIED;
    }

    test::TemporaryFolder folder_;
    Moment now_{1'700'000'000'000, 1'000'000};
    std::optional<JobQueue> queue_{std::in_place, folder_.path(), QueueOptions{}, now_};
};

TEST_F(Holds, FailedFramesAreTriedAgainInTheSameJob)
{
    const auto job = submit(job_of(3));
    fail(Ending::failed, "bad");
    fail(Ending::failed, "worse");
    complete();
    EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    EXPECT_EQ(code_of_retry(job, {99}), v1::ERROR_CODE_NOT_FOUND);
    EXPECT_EQ(queue_->retry(job, {12}, now_), 0u) << "it is completed";
    EXPECT_EQ(queue_->retry(job, {11}, now_), 1u);
    queue_->commit();
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
    EXPECT_EQ(queue_->status(job)->error().message(), "bad") << "of the frame that is failed still";
    reopen();
    EXPECT_EQ(start(), (FrameKey{job, 1}));
    queue_->complete({job, 1}, {"results/y", {}, "{}", {}, 0.0}, now_);
    EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    EXPECT_EQ(queue_->retry(job, {}, now_), 1u);
    complete();
    EXPECT_EQ(state(job), v1::JOB_STATE_COMPLETED);
    EXPECT_FALSE(queue_->status(job)->has_error());
    EXPECT_EQ(queue_->retry(job, {}, now_), 0u);
}

TEST_F(Holds, ACancelledJobIsTriedAgain)
{
    const auto job = submit(job_of(2));
    const FrameKey running = start();
    queue_->cancel(job, now_);
    EXPECT_EQ(code_of_retry(job, {}), v1::ERROR_CODE_CONFLICT) << "it is being stopped";
    queue_->fail(running, Ending::failed, {}, now_);
    EXPECT_EQ(state(job), v1::JOB_STATE_CANCELLED);
    EXPECT_EQ(queue_->retry(job, {}, now_), 2u);
    EXPECT_EQ(state(job), v1::JOB_STATE_QUEUED);
    complete();
    complete();
    EXPECT_EQ(state(job), v1::JOB_STATE_COMPLETED);
    queue_->commit();
    EXPECT_EQ(queue_->count(v1::JOB_STATE_COMPLETED), 1u);
    EXPECT_EQ(queue_->count(v1::FRAME_STATE_COMPLETED), 2u);
}

TEST_F(Holds, EachKindOfFailureHasItsTries)
{
    const struct {
        Ending ending;
        int tries;
        std::int64_t wait_ms;
    } kinds[] = {{Ending::failed, 1, 0},
                 {Ending::may_pass, 3, 1000},
                 {Ending::died, 2, 1000},
                 {Ending::over_memory, 2, 10'000},
                 {Ending::over_time, 1, 0}};
    for (const auto& kind : kinds) {
        const auto job = submit(job_of(1));
        std::int64_t wait = kind.wait_ms;
        for (int i = 1; i < kind.tries; ++i, wait *= 4) {
            fail(kind.ending);
            pass(wait - 1);
            EXPECT_FALSE(anything_next());
            pass(1);
        }
        fail(kind.ending);
        EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    }
    QueueOptions patient;
    patient.time = {2, 0.0};
    reopen(patient);
    const auto job = submit(job_of(1));
    fail(Ending::over_time);
    complete();
    EXPECT_EQ(state(job), v1::JOB_STATE_COMPLETED);
}

TEST_F(Holds, KindsAreCountedApart)
{
    const auto job = submit(job_of(1));
    for (const Ending ending : {Ending::may_pass, Ending::died, Ending::over_memory, Ending::may_pass}) {
        fail(ending);
        EXPECT_NE(state(job), v1::JOB_STATE_FAILED);
        pass(300'000);
    }
    fail(Ending::died);
    EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
}

TEST_F(Holds, APausedJobStartsNothingAndSurvivesTheServer)
{
    const auto job = submit(job_of(3));
    const FrameKey running = start();
    EXPECT_TRUE(queue_->pause(job, true, now_));
    EXPECT_FALSE(queue_->pause(job, true, now_));
    EXPECT_EQ(state(job), v1::JOB_STATE_PAUSED);
    EXPECT_FALSE(anything_next());
    queue_->complete(running, {"results/x", {}, "{}", {}, 0.0}, now_);
    queue_->commit();
    EXPECT_EQ(state(job), v1::JOB_STATE_PAUSED);
    reopen();
    EXPECT_FALSE(anything_next());
    EXPECT_TRUE(queue_->pause(job, false, now_));
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
    complete();
    complete();
    EXPECT_EQ(state(job), v1::JOB_STATE_COMPLETED);
}

TEST_F(Holds, ThePausedQueueTakesJobsAndStartsNone)
{
    EXPECT_TRUE(queue_->pause_all(true));
    queue_->commit();
    submit(job_of(1));
    EXPECT_FALSE(anything_next());
    reopen();
    EXPECT_TRUE(queue_->is_paused());
    EXPECT_FALSE(anything_next());
    queue_->pause_all(false);
    queue_->roll_back();
    EXPECT_FALSE(anything_next()) << "that was undone";
    EXPECT_TRUE(queue_->pause_all(false));
    EXPECT_FALSE(queue_->pause_all(false));
    EXPECT_TRUE(anything_next());
}

TEST_F(Holds, APriorityCanBeChanged)
{
    const auto first = submit(job_of(2)), second = submit(job_of(2));
    EXPECT_EQ(start().job, first);
    EXPECT_EQ(queue_->set_priority(second, 7, now_), 0);
    EXPECT_EQ(start().job, second);
    reopen();
    EXPECT_EQ(queue_->status(second)->priority(), 0) << "it was not committed";
    queue_->set_priority(second, -7, now_);
    queue_->commit();
    reopen();
    EXPECT_EQ(start().job, first);
}

TEST_F(Holds, EqualFailuresEndAJob)
{
    v1::Job asked = job_of(10);
    asked.set_stop_after(3);
    const auto job = submit(asked);
    fail(Ending::failed, "took 812 MB");
    fail(Ending::failed, "something else");
    const FrameKey running = start();
    fail(Ending::failed, "took 9 MB");
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
    fail(Ending::failed, "took 10 MB");
    EXPECT_EQ(state(job), v1::JOB_STATE_CANCEL_REQUESTED) << "what runs is stopped";
    queue_->fail(running, Ending::failed, {}, now_);
    const v1::JobStatus end = *queue_->status(job);
    EXPECT_EQ(end.state(), v1::JOB_STATE_FAILED);
    EXPECT_EQ(end.error().message(), "stopped after 3 frames had failed alike: took 10 MB");
    EXPECT_EQ(end.frames_cancelled(), 6);
    v1::JobRequest request;
    request.set_job(job);
    request.add_states(v1::FRAME_STATE_CANCELLED);
    request.set_first_frame(1);
    const v1::JobReply details = queue_->details(request);
    ASSERT_EQ(details.frames_size(), 5) << "pages of one state";
    EXPECT_NE(details.frames(0).error().message().find("failed alike"), std::string::npos);
    EXPECT_EQ(queue_->retry(job, {}, now_), 10u) << "and counts begin anew";
    fail(Ending::failed, "took 1 MB");
    EXPECT_EQ(state(job), v1::JOB_STATE_RUNNING);
}

TEST_F(Holds, AJobWaitsForOthers)
{
    const auto first = submit(job_of(1)), second = submit(job_of(1));
    v1::Job asked = job_of(1);
    asked.add_after(first);
    asked.add_after(second);
    asked.set_priority(9);
    const auto last = submit(asked);
    EXPECT_EQ(queue_->status(last)->waits_for_size(), 2);
    reopen();
    complete();
    EXPECT_EQ(queue_->status(last)->waits_for(0), second);
    complete();
    EXPECT_EQ(queue_->status(last)->waits_for_size(), 0);
    EXPECT_EQ(start().job, last);
    asked.add_after(777);
    EXPECT_THROW(submit(asked), ServiceError) << "there is no such job";
}

TEST_F(Holds, WhatDoesNotCompleteFailsAllThatWaitForIt)
{
    const auto first = submit(job_of(2));
    std::vector<std::uint64_t> chain{first};
    for (int i = 0; i < 3; ++i) {
        v1::Job asked = job_of(2);
        asked.add_after(chain.back());
        chain.push_back(submit(asked));
    }
    fail(Ending::failed, "no such camera");
    EXPECT_EQ(state(chain.back()), v1::JOB_STATE_QUEUED);
    complete();
    for (const auto job : chain) EXPECT_EQ(state(job), v1::JOB_STATE_FAILED);
    const std::string why = queue_->status(chain.back())->error().message();
    EXPECT_NE(why.find("which it waits for, failed"), std::string::npos) << why;
    EXPECT_NE(why.find("no such camera"), std::string::npos) << why;
    EXPECT_EQ(queue_->status(chain[1])->error().code(), v1::ERROR_CODE_DEPENDENCY);
    v1::Job late = job_of(1);
    late.add_after(first);
    EXPECT_EQ(state(submit(late)), v1::JOB_STATE_FAILED) << "no matter which came first";
    EXPECT_EQ(code_of_retry(chain[1], {}), v1::ERROR_CODE_CONFLICT);
    EXPECT_EQ(queue_->retry(first, {}, now_), 1u);
    EXPECT_EQ(queue_->retry(chain[1], {}, now_), 2u);
    complete();
    EXPECT_EQ(state(first), v1::JOB_STATE_COMPLETED);
    EXPECT_EQ(start().job, chain[1]);
}

TEST_F(Holds, OwnersHaveTheirShareOfTheQueue)
{
    reopen({.max_owner_frames = 5});
    submit(job_of(3));
    EXPECT_THROW(submit(job_of(3)), ServiceError);
    submit(job_of(5), "uid:2");
    complete();
    submit(job_of(3));
}

TEST_F(Holds, TellsHowLongThingsTook)
{
    const auto job = submit(job_of(2));
    pass(3000);
    const FrameKey first = start();
    pass(2500);
    queue_->complete(first, {"results/x", {}, "{}", {}, 0.02}, now_);
    const v1::JobStatus status = *queue_->status(job);
    EXPECT_DOUBLE_EQ(status.waited_seconds(), 3.0);
    EXPECT_DOUBLE_EQ(status.busy_seconds(), 2.5);
    EXPECT_DOUBLE_EQ(status.fraction(), 0.5);
    EXPECT_DOUBLE_EQ(status.error_estimate(), 0.02);
    EXPECT_NEAR(*queue_->share().eta_seconds(job, 1), 2.5, 0.01);
}

}  // namespace
}  // namespace rcs::service
