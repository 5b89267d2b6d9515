#include "placement/forecast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "accuracy/error_estimate.h"

namespace rcs {
namespace {

constexpr float kGather = 64.0f;

/// Areas and noise that differ, and spread in proportion to `spread`.
std::vector<RecordShare> some_shares(std::size_t count, float spread)
{
    std::mt19937 engine(3);
    std::normal_distribution<float> normal(0.0f, 0.5f);
    std::vector<RecordShare> shares(count);
    for (RecordShare& s : shares) {
        s.area = 10.0f * std::exp(normal(engine));
        s.single = std::exp(normal(engine));
        s.spread = spread * std::exp(normal(engine));
        s.rays = kGather;
    }
    return shares;
}

TEST(WalkAhead, StartsAtTheErrorThatIsSeen)
{
    for (const float spread : {0.0f, 0.05f, 0.5f}) {
        const std::vector<RecordShare> shares = some_shares(500, spread);
        const std::vector<PathPoint> path = walk_ahead(shares, kGather, 1.0, 0.01);
        EXPECT_NEAR(path.front().error, allot(shares, 0.0, kMostRays).error, 1e-6);
        EXPECT_EQ(path.front().rays, 0.0);
        EXPECT_EQ(path.front().looks, 0.0);
    }
}

/// Nothing around looks at what is lit: the records make none of the picture.
TEST(WalkAhead, WithoutLightThereIsNothingToDo)
{
    std::vector<RecordShare> shares = some_shares(10, 0.1f);
    for (RecordShare& s : shares) s.area = 0.0f;
    const PathPoint to = read_path(walk_ahead(shares, kGather, 0.8, 0.01), 0.05);
    EXPECT_EQ(to.rays, 0.0);
    EXPECT_EQ(to.looks, 0.0);
}

/// Noise alone takes what one allotment would, and more for the spread that may hide behind it.
TEST(WalkAhead, TakesNoFewerRaysThanTheNoiseAlone)
{
    const std::vector<RecordShare> shares = some_shares(1000, 0.0f);
    const std::vector<PathPoint> path = walk_ahead(shares, kGather, 1.0, 0.01);
    for (const double error : {0.06, 0.03, 0.02})
        EXPECT_GE(read_path(path, error).rays, allot_for_error(shares, error, kMostRays).rays) << error;
}

/// Spread has to be brought down by closer records, which begin with few rays.
TEST(WalkAhead, TakesMoreWithMoreSpread)
{
    double rays = 0.0;
    for (const float spread : {0.0f, 0.05f, 0.1f, 0.2f}) {
        const std::vector<PathPoint> path = walk_ahead(some_shares(1000, spread), kGather, 1.0, 0.02);
        const PathPoint to = read_path(path, 0.03);
        EXPECT_GT(to.rays, rays) << spread;
        rays = to.rays;
    }
}

TEST(WalkAhead, NeedsOnlyASampleOfManyShares)
{
    const std::vector<PathPoint> few = walk_ahead(some_shares(1500, 0.1f), kGather, 1.0, 0.02);
    const std::vector<PathPoint> many = walk_ahead(some_shares(60'000, 0.1f), kGather, 1.0, 0.02);
    EXPECT_NEAR(read_path(many, 0.04).rays / (40.0 * read_path(few, 0.04).rays), 1.0, 0.15);
}

TEST(WalkAhead, TakesMoreWhereStepsComeLessFar)
{
    const std::vector<RecordShare> shares = some_shares(1000, 0.1f);
    const PathPoint far = read_path(walk_ahead(shares, kGather, 1.0, 0.02), 0.04);
    EXPECT_GT(read_path(walk_ahead(shares, kGather, progress_of_step(0.95), 0.02), 0.04).rays, far.rays);
    EXPECT_EQ(progress_of_step(kStep), 1.0);
    EXPECT_EQ(progress_of_step(1.2), progress_of_step(1.0)) << "not below what is believed";
}

TEST(ReadPath, AsksForMoreTheSmallerTheErrorBeyondItsEndAsWell)
{
    const std::vector<PathPoint> path = walk_ahead(some_shares(1000, 0.1f), kGather, 1.0, 0.02);
    EXPECT_EQ(read_path(path, 2.0 * path.front().error).rays, 0.0);
    PathPoint before;
    for (double error = path.front().error; error > 0.25 * path.back().error; error *= 0.9) {
        const PathPoint to = read_path(path, error);
        EXPECT_GE(to.rays, before.rays) << error;
        EXPECT_GE(to.looks, before.looks) << error;
        before = to;
    }
    const PathPoint end = path.back(), half = read_path(path, 0.5 * end.error);
    EXPECT_NEAR(half.rays, std::pow(2.0, 1.0 / double{kNoiseFall}) * end.rays, 1e-6 * half.rays);
}

}  // namespace
}  // namespace rcs
