#include "rcs/sweep.h"

#include <cmath>

#include <gtest/gtest.h>

#include "rcs/error.h"

namespace rcs {
namespace {

using Indices = std::vector<std::size_t>;

TEST(ParetoFront, LeavesOutWhatIsSlowerAndNoBetter)
{
    //                                     0             1            2 (beaten)   3            4 (beaten)
    const std::vector<CostPoint> points{{4.0, 0.05}, {1.0, 0.20}, {5.0, 0.05}, {2.0, 0.10}, {3.0, 0.15}};
    EXPECT_EQ(pareto_front(points), (Indices{1, 3, 0}));
}

TEST(ParetoFront, TakesTheBetterOfEqualTimesAndTheFirstOfEqualPoints)
{
    EXPECT_EQ(pareto_front({{1.0, 0.3}, {1.0, 0.2}, {1.0, 0.2}}), Indices{1});
    EXPECT_EQ(pareto_front({}), Indices{});
}

TEST(SecondsForError, FollowsThePowerLawBetweenTwoPoints)
{
    // error = time^-1/2: half of the error costs four times the time, everywhere.
    const std::vector<CostPoint> points{{1.0, 0.4}, {16.0, 0.1}};
    EXPECT_NEAR(seconds_for_error(points, 0.2).value(), 4.0, 1e-12);
    EXPECT_NEAR(seconds_for_error(points, 0.1).value(), 16.0, 1e-12);
    EXPECT_NEAR(seconds_for_error(points, 0.4).value(), 1.0, 1e-12);
}

TEST(SecondsForError, IgnoresBeatenPoints)
{
    const std::vector<CostPoint> points{{1.0, 0.4}, {16.0, 0.1}, {20.0, 0.2}};
    EXPECT_NEAR(seconds_for_error(points, 0.2).value(), 4.0, 1e-12);
}

TEST(SecondsForError, IsNoneBeyondTheFinestAndTheQuickestBeforeTheCoarsest)
{
    const std::vector<CostPoint> points{{1.0, 0.4}, {16.0, 0.1}};
    EXPECT_FALSE(seconds_for_error(points, 0.09).has_value());
    EXPECT_EQ(seconds_for_error(points, 0.9), 1.0);
    EXPECT_FALSE(seconds_for_error({}, 0.1).has_value());
    EXPECT_EQ(seconds_for_error({{1.0, 0.4}, {2.0, 0.0}}, 0.1), 2.0) << "an error of 0 has no logarithm";
}

TEST(SettingsSweep, GoesFromCoarseToFineAndKeepsAllOtherOptions)
{
    RenderOptions base;
    base.width = 7;
    base.seed = 5;
    for (const int count : {2, 5, kMostSweepPoints}) {
        const std::vector<SweepPoint> points = settings_sweep(base, count);
        ASSERT_EQ(points.size(), static_cast<std::size_t>(count));
        for (std::size_t i = 0; i < points.size(); ++i) {
            EXPECT_EQ(points[i].options.width, 7);
            EXPECT_EQ(points[i].options.seed, 5u);
            EXPECT_NO_THROW(validate(points[i].options));
            if (i == 0) continue;
            const QualitySettings coarse = settings_or_default(points[i - 1].options),
                                  fine = settings_or_default(points[i].options);
            EXPECT_LE(fine.error_tolerance, coarse.error_tolerance);
            EXPECT_GE(fine.rays, coarse.rays);
            EXPECT_LT(fine.noise_target, coarse.noise_target);
        }
        EXPECT_EQ(settings_or_default(points.front().options).error_tolerance, 0.5f);
        EXPECT_EQ(settings_or_default(points.back().options).error_tolerance, 0.07f);
    }
}

TEST(SettingsSweep, HoldsTheDefaultSettings)
{
    const RecordSettings defaults;
    const SweepPoint wanted = settings_point({}, defaults.error_tolerance, defaults.rays, defaults.noise_target);
    EXPECT_EQ(wanted.label, "--accuracy 0.2 --rays 128 --noise 0.02");
    int found = 0;
    for (const SweepPoint& point : settings_sweep({}, kMostSweepPoints)) found += point.label == wanted.label ? 1 : 0;
    EXPECT_EQ(found, 1);
}

TEST(SettingsSweep, RefusesFewerThanTwoPointsAndMoreThanThereAre)
{
    for (const int count : {1, kMostSweepPoints + 1}) {
        try {
            settings_sweep({}, count);
            FAIL() << count;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::bad_argument);
        }
    }
}

}  // namespace
}  // namespace rcs
