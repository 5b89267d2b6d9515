#include "placement/allotment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace rcs {
namespace {

constexpr float kMost = 1e9f;
const double kMeanAbsolute = std::sqrt(2.0 / std::numbers::pi);

/// Areas and noise that differ widely, no spread.
std::vector<RecordShare> uneven(std::size_t count)
{
    std::mt19937 engine(7);
    std::normal_distribution<float> normal(0.0f, 1.0f);
    std::vector<RecordShare> shares(count);
    for (RecordShare& s : shares) {
        s.area = std::exp(normal(engine));
        s.single = std::exp(normal(engine));
    }
    return shares;
}

double mean_noise(const std::vector<RecordShare>& shares, const std::vector<double>& rays)
{
    double error = 0.0, area = 0.0;
    for (std::size_t k = 0; k < shares.size(); ++k) {
        error += static_cast<double>(shares[k].area * noise_with(shares[k], static_cast<float>(rays[k])));
        area += static_cast<double>(shares[k].area);
    }
    return kMeanAbsolute * error / area;
}

TEST(Allot, CostsLittleMoreThanTheLeastAndMuchLessThanEvenNoise)
{
    const std::vector<RecordShare> shares = uneven(4000);
    const Allotment a = allot_for_error(shares, 0.02, kMost);
    EXPECT_NEAR(a.error, 0.02, 1e-4);
    // The same number of rays, shared out by other powers of what hangs on them.
    const auto error_by_power = [&](double power, bool area) {
        std::vector<double> rays;
        double sum = 0.0;
        for (const RecordShare& s : shares) {
            rays.push_back(std::pow(static_cast<double>(area ? s.area * s.single : s.single), power));
            sum += rays.back();
        }
        for (double& n : rays) n *= (a.rays + static_cast<double>(shares.size())) / sum;
        return mean_noise(shares, rays);
    };
    const double least = error_by_power(1.0 / (1.0 + double{kNoiseFall}), true);
    EXPECT_LT(least, a.error);
    EXPECT_LT(a.error * a.error, 1.3 * least * least);
    EXPECT_LT(a.error, 0.75 * error_by_power(1.0 / double{kNoiseFall}, false))
        << "rays that make the noise the same everywhere";
}

TEST(Allot, TakesNoRaysBackAndGivesNoneBeyondTheMost)
{
    std::vector<RecordShare> shares = uneven(100);
    shares[3].rays = 5000.0f;
    for (const double level : {1e-3, 1.0, 1e3, 1e9})
        for (const RecordShare& s : shares) {
            EXPECT_GE(rays_at(s, level, 1000.0f), s.rays);
            EXPECT_LE(rays_at(s, level, 1000.0f), std::max(s.rays, 1000.0f));
        }
}

TEST(Allot, SmallerErrorsTakeMoreRaysOfEachRecord)
{
    const std::vector<RecordShare> shares = uneven(300);
    double level = 0.0;
    for (const double error : {0.2, 0.1, 0.05, 0.03}) {
        const Allotment a = allot_for_error(shares, error, kMost);
        EXPECT_GT(a.level, level);
        EXPECT_LE(a.error, error);
        level = a.level;
    }
}

TEST(Allot, ForRaysSpendsThem)
{
    const std::vector<RecordShare> shares = uneven(300);
    EXPECT_NEAR(allot_for_rays(shares, 12345.0, kMost).rays, 12345.0, 1.0);
}

TEST(Allot, WhatSpreadLeavesIsNotBoughtWithRays)
{
    std::vector<RecordShare> shares = uneven(100);
    for (RecordShare& s : shares) s.spread = 0.1f;
    const Allotment a = allot_for_error(shares, 0.01, kMost);
    EXPECT_GT(a.error, 0.1 * kMeanAbsolute);
    EXPECT_LT(a.error, 0.106 * kMeanAbsolute);
    EXPECT_LT(a.rays, 1e8);
}

TEST(Allot, CountsRecordsThatAreAlike)
{
    std::vector<RecordShare> all = uneven(50), alike = all;
    for (RecordShare& s : alike) s.count = 3.0f;
    for (int copy = 0; copy < 2; ++copy)
        for (std::size_t k = 0; k < 50; ++k) all.push_back(all[k]);
    const Allotment one = allot(all, 100.0, kMost), other = allot(alike, 100.0, kMost);
    EXPECT_NEAR(other.error, one.error, 1e-6 * one.error);
    EXPECT_NEAR(other.rays, one.rays, 1e-6 * one.rays);
}

TEST(Densities, BringTheMeanSpreadDownWithFewerRecordsThanAnEvenShare)
{
    std::vector<RecordShare> shares = uneven(2000);
    std::mt19937 engine(9);
    std::exponential_distribution<float> spread(10.0f);
    for (RecordShare& s : shares) s.spread = spread(engine);
    const std::vector<float> density = densities(shares, 0.5, kMost);
    double before = 0.0, after = 0.0, records = 0.0;
    for (std::size_t k = 0; k < shares.size(); ++k) {
        before += static_cast<double>(shares[k].area * shares[k].spread);
        after += static_cast<double>(shares[k].area * spread_at(shares[k], density[k]));
        records += static_cast<double>(density[k]);
        EXPECT_GE(density[k], 1.0f);
    }
    EXPECT_NEAR(after, 0.5 * before, 1e-3 * before);
    EXPECT_LT(records, 0.8 * std::pow(2.0, 1.0 / kSpreadFall) * 2000.0)
        << "as many more of all of them would do as well";
}

TEST(Densities, AreOneWhereSpreadIsSmallEnough)
{
    for (const float d : densities(uneven(10), 1.5, 4.0f)) EXPECT_EQ(d, 1.0f);
}

}  // namespace
}  // namespace rcs
