#include "queue/fair_share.h"

#include <chrono>
#include <map>

#include <gtest/gtest.h>

namespace rcs::service {
namespace {

constexpr double kSlice = 10.0, kAgeing = 600.0;  // [s]

/// Workers that take what is next, one frame after the other; each frame takes what its job's do.
class Share : public ::testing::Test {
protected:
    Share() { share_.set_options({kAgeing, kSlice, 0}); }

    void add(std::uint64_t job, const std::string& owner, std::int64_t frames, double seconds, int priority = 0)
    {
        share_.add(job, owner, priority, false, clock_ms_);
        share_.set_frames(job, {frames, 0, 0, 0}, clock_ms_);
        seconds_[job] = seconds;
    }
    /// One frame. @return its job; 0: there is none
    std::uint64_t run()
    {
        const auto job = share_.next(clock_ms_, clock_ms_);
        if (!job) return 0;
        FairShare::Frames frames = share_.frames(*job);
        const double charged = share_.begin(*job, clock_ms_);
        frames.queued -= 1;
        share_.set_frames(*job, {frames.queued, 0, 1, 0}, clock_ms_);
        clock_ms_ += static_cast<std::int64_t>(1e3 * seconds_.at(*job));
        share_.end(*job, seconds_.at(*job), charged, true);
        share_.set_frames(*job, {frames.queued, 0, 0, 0}, clock_ms_);
        return *job;
    }
    /// Workers' time that each job got in so much [s].
    std::map<std::uint64_t, double> run_for(double seconds)
    {
        std::map<std::uint64_t, double> got;
        for (const std::int64_t until = clock_ms_ + static_cast<std::int64_t>(1e3 * seconds); clock_ms_ < until;) {
            const std::uint64_t job = run();
            if (job == 0) break;
            got[job] += seconds_.at(job);
        }
        return got;
    }

    FairShare share_;
    std::map<std::uint64_t, double> seconds_;
    std::int64_t clock_ms_ = 1'000'000;
};

TEST_F(Share, OwnersGetTheSameTimeHoweverManyJobsTheyHaveAndHoweverLongTheirFramesTake)
{
    add(1, "a", 100'000, 0.5);
    add(2, "a", 100'000, 0.5);
    add(3, "b", 100'000, 7.0);
    const auto got = run_for(2000.0);
    EXPECT_NEAR(got.at(3), got.at(1) + got.at(2), 3 * kSlice);
    EXPECT_NEAR(got.at(1), got.at(2), 3 * kSlice) << "jobs of one owner share his";
}

TEST_F(Share, AJobKeepsItsTurnForASlice)
{
    add(1, "a", 1000, 1.0);
    add(2, "a", 1000, 1.0);
    int changes = 0;
    std::uint64_t last = run();
    for (int i = 0; i < 200; ++i) {
        const std::uint64_t now = run();
        changes += now != last;
        last = now;
    }
    EXPECT_GT(changes, 5);
    EXPECT_LT(changes, 30) << "scenes are loaded anew with each";
}

TEST_F(Share, WhoComesNewlyIsServedSoonAndMakesUpForNothing)
{
    add(1, "a", 100'000, 1.0);
    run_for(500.0);
    add(2, "b", 100'000, 1.0);
    EXPECT_EQ(run(), 2u);
    const auto got = run_for(400.0);
    EXPECT_NEAR(got.at(1), 200.0, 2 * kSlice);
}

TEST_F(Share, PrioritiesComeFirstAndLowerOnesAreNotForgotten)
{
    add(1, "a", 100'000, 10.0, 0);
    add(2, "b", 100'000, 10.0, 3);
    const auto got = run_for(20 * 3 * kAgeing);
    EXPECT_NEAR(got.at(1) / 10.0, 20.0, 1.0) << "a frame for every three steps of ageing";
}

TEST_F(Share, AnOwnersFramesAreLimited)
{
    share_.set_options({kAgeing, kSlice, 2});
    add(1, "a", 5, 1.0);
    share_.set_frames(1, {3, 0, 2, 0}, clock_ms_);
    EXPECT_FALSE(share_.next(clock_ms_, clock_ms_));
    add(2, "b", 1, 1.0, -5);
    EXPECT_EQ(share_.next(clock_ms_, clock_ms_), 2u) << "others do not wait for him";
    share_.set_frames(1, {3, 0, 1, 0}, clock_ms_);
    EXPECT_EQ(share_.next(clock_ms_, clock_ms_), 1u);
}

TEST_F(Share, AHeldJobAndARetryThatIsNotDueAreNotNext)
{
    add(1, "a", 5, 1.0);
    share_.set_held(1, true, clock_ms_);
    EXPECT_FALSE(share_.next(clock_ms_, clock_ms_));
    share_.set_held(1, false, clock_ms_);
    share_.set_frames(1, {0, 2, 0, clock_ms_ + 50}, clock_ms_);
    EXPECT_FALSE(share_.next(clock_ms_ + 49, clock_ms_ + 49));
    EXPECT_EQ(share_.next_retry_ms(), clock_ms_ + 50);
    EXPECT_EQ(share_.next(clock_ms_ + 50, clock_ms_ + 50), 1u);
    share_.forget(1);
    EXPECT_FALSE(share_.next(clock_ms_ + 50, clock_ms_ + 50));
    EXPECT_EQ(share_.frames_of("a"), 0);
}

TEST_F(Share, EstimatesWhenJobsEnd)
{
    add(1, "a", 11, 2.0);
    add(2, "b", 31, 2.0);
    EXPECT_EQ(share_.eta_seconds(1, 2), std::nullopt) << "nothing is known yet";
    run_for(4.0);
    EXPECT_NEAR(*share_.eta_seconds(2), 2.0 * 40 / 2, 1.0);
    EXPECT_NEAR(*share_.eta_seconds(1, 2), 2.0 * (9 + 9) / 2, 4.1) << "they take turns";
    EXPECT_NEAR(*share_.eta_seconds(2, 2), 2.0 * 40 / 2, 4.1);
    share_.set_priority(2, 5, clock_ms_);
    EXPECT_NEAR(*share_.eta_seconds(1, 2), 2.0 * 40 / 2, 4.1);
}

}  // namespace
}  // namespace rcs::service
