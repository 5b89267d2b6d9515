#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/records.h"

namespace rcs {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Records in a box of 4 m, distances over three decades, every tenth without any hit; no gradients.
std::vector<Record> random_records(std::size_t count, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::vector<Record> records(count);
    for (std::size_t k = 0; k < count; ++k) {
        Record& r = records[k];
        r.position = 4.0f * glm::vec3(unit(random), unit(random), unit(random));
        if (k % 50 == 49) r.position = records[k - 1].position;  // coincident ones, too
        r.harmonic_mean_distance = k % 10 == 9 ? kInfinity : 0.01f * std::pow(1000.0f, unit(random));
        r.footprint = 0.005f + 0.02f * unit(random);
        r.irradiance = glm::vec3(1.0f);
    }
    return records;
}

std::vector<Record> limited(std::vector<Record> records, const RecordSettings& options, int threads = 2)
{
    ThreadPool pool(threads);
    limit_spacing(records, options, pool);
    return records;
}

TEST(LimitSpacing, IsTheBruteForceNeighbourClampingWithinThePixelRange)
{
    const RecordSettings options;
    const std::vector<Record> records = random_records(2000, 1);
    const std::vector<Record> result = limited(records, options);
    int clamped_by_neighbours = 0;
    for (std::size_t i = 0; i < records.size(); ++i) {
        double reach = static_cast<double>(records[i].harmonic_mean_distance);
        const double own = reach;
        for (const Record& other : records)
            reach = std::min(reach, static_cast<double>(other.harmonic_mean_distance) +
                                        glm::distance(glm::dvec3(other.position), glm::dvec3(records[i].position)));
        const double pixel = static_cast<double>(records[i].footprint);
        const double low = static_cast<double>(options.min_reach) * pixel;
        const double high = static_cast<double>(options.max_reach) * pixel;
        clamped_by_neighbours += reach < own && reach > low && reach < high ? 1 : 0;
        const double expected = static_cast<double>(options.error_tolerance) * std::clamp(reach, low, high);
        // Float distances and sums: a few ulps.
        ASSERT_NEAR(static_cast<double>(result[i].spacing_radius), expected, 1e-6 * expected) << "record " << i;
    }
    EXPECT_GT(clamped_by_neighbours, 200) << "the case that matters occurs";
}

/// Where light is steep records, and those around, lie closer than the least reach allows elsewhere: else those in a
/// dark cranny would reach a pixel, and the light ones beside it into the cranny.
TEST(LimitSpacing, IsTheBruteForceClampingWhereLightIsSteepToo)
{
    const RecordSettings options;
    std::vector<Record> records = random_records(2000, 7);
    std::mt19937 random(8);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    for (Record& r : records)
        if (unit(random) < 0.2f) r.gradient_reach = options.min_reach * r.footprint * unit(random);
    const std::vector<Record> result = limited(records, options);
    const auto low = [&](const Record& r) { return static_cast<double>(options.min_reach * r.footprint); };
    const auto steep = [&](const Record& r) {
        return std::clamp(4.0 * static_cast<double>(r.gradient_reach), low(r) / 3.0, low(r));
    };
    int below = 0, by_neighbours = 0;
    for (std::size_t i = 0; i < records.size(); ++i) {
        const Record& r = records[i];
        double near = static_cast<double>(r.harmonic_mean_distance), least = low(r);
        for (const Record& other : records) {
            const double distance = glm::distance(glm::dvec3(other.position), glm::dvec3(r.position));
            const bool is_steep = steep(other) < low(other);
            const auto mean = static_cast<double>(other.harmonic_mean_distance);
            near = std::min(near, distance + (is_steep ? std::min(steep(other), mean) : mean));
            if (is_steep) least = std::min(least, std::max(distance, steep(other)));
        }
        if (least < low(r)) near = std::min(near, least);
        const double wanted = std::min(near, static_cast<double>(options.gradient_limit * r.gradient_reach));
        const double reach =
            std::clamp(wanted, std::max(least, low(r) / 3.0), static_cast<double>(options.max_reach * r.footprint));
        const double expected = static_cast<double>(options.error_tolerance) * reach;
        ASSERT_NEAR(static_cast<double>(result[i].spacing_radius), expected, 1e-5 * expected) << "record " << i;
        below += reach < 0.99 * low(r) ? 1 : 0;
        by_neighbours += reach < 0.99 * low(r) && steep(r) == low(r) ? 1 : 0;
    }
    EXPECT_GT(below, 100);
    EXPECT_GT(by_neighbours, 10) << "the case that matters occurs";
}

TEST(LimitSpacing, IsAFixedPoint)
{
    // No record's reach exceeds another's by more than the distance between them: clamping again changes nothing.
    RecordSettings options;
    options.min_reach = 1e-6f;
    options.max_reach = 1e9f;
    options.error_tolerance = 1.0f;
    const std::vector<Record> records = limited(random_records(500, 2), options);
    for (const Record& a : records)
        for (const Record& b : records)
            ASSERT_LE(a.spacing_radius, (b.spacing_radius + glm::distance(a.position, b.position)) * (1.0f + 1e-6f));
}

TEST(LimitSpacing, DoesNotDependOnTheOrderOfTheRecordsOrOnThreads)
{
    const RecordSettings options;
    const std::vector<Record> records = random_records(2000, 3);
    const std::vector<Record> straight = limited(records, options, 1);
    std::vector<std::size_t> order(records.size());
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), std::mt19937(4));
    std::vector<Record> mixed;
    for (const std::size_t k : order) mixed.push_back(records[k]);
    mixed = limited(mixed, options, 3);
    for (std::size_t k = 0; k < order.size(); ++k) {
        ASSERT_EQ(mixed[k].spacing_radius, straight[order[k]].spacing_radius) << k;
        ASSERT_EQ(mixed[k].gradient_scale, straight[order[k]].gradient_scale) << k;
    }
}

TEST(LimitSpacing, DoneTwiceIsDoneOnce)
{
    const RecordSettings options;
    const std::vector<Record> once = limited(random_records(300, 5), options);
    const std::vector<Record> twice = limited(once, options);
    for (std::size_t k = 0; k < once.size(); ++k) ASSERT_EQ(twice[k].spacing_radius, once[k].spacing_radius);
}

TEST(LimitSpacing, OfARecordThatHitNothingIsTheWidest)
{
    RecordSettings options;
    std::vector<Record> records(1);
    records[0].harmonic_mean_distance = kInfinity;
    records[0].footprint = 0.01f;
    records[0].irradiance = glm::vec3(1.0f);
    records = limited(records, options);
    EXPECT_FLOAT_EQ(records[0].spacing_radius, options.error_tolerance * options.max_reach * 0.01f);
    EXPECT_EQ(records[0].gradient_scale, 1.0f);
    EXPECT_TRUE(std::isinf(records[0].harmonic_mean_distance)) << "R_k itself is kept";
}

TEST(LimitSpacing, OfARecordInACornerIsTheClosestAndTrustsItsGradientLess)
{
    const RecordSettings options;
    std::vector<Record> records(1);
    records[0].footprint = 0.01f;
    records[0].irradiance = glm::vec3(1.0f);
    for (const float distance : {0.0f, 0.001f, 0.05f}) {
        records[0].harmonic_mean_distance = distance;
        const Record r = limited(records, options)[0];
        EXPECT_FLOAT_EQ(r.spacing_radius, options.error_tolerance * options.min_reach * 0.01f);
        EXPECT_NEAR(r.gradient_scale, distance / (options.min_reach * 0.01f), 1e-6f);
    }
}

TEST(LimitSpacing, ShrinksWhereTheGradientIsSteep)
{
    const RecordSettings options;
    const float reach = options.max_reach * 0.01f;
    for (const float steepness : {0.0f, 1.0f, 5.0f, 8.0f, 20.0f, 1e6f}) {
        std::vector<Record> records(1);
        records[0].harmonic_mean_distance = kInfinity;
        records[0].footprint = 0.01f;
        records[0].irradiance = glm::vec3(1.0f);
        records[0].gradient_reach = 1.0f / steepness;
        const Record r = limited(records, options)[0];
        const float least = options.min_reach * 0.01f, steep = std::clamp(4.0f / steepness, least / 3.0f, least);
        const float expected = std::clamp(options.gradient_limit / steepness, steep, reach);
        EXPECT_NEAR(r.spacing_radius, options.error_tolerance * expected, 1e-6f) << steepness;
        EXPECT_GE(r.gradient_scale, 0.0f);
        EXPECT_LE(r.gradient_scale, 1.0f);
    }
}

TEST(LimitSpacing, OfBlackRecordsIsFinite)
{
    std::vector<Record> records = random_records(100, 6);
    for (std::size_t k = 0; k < records.size(); ++k) {
        records[k].irradiance = glm::vec3(0.0f);
        if (k % 2 == 0) records[k].gradient_reach = 0.0f;
    }
    for (const Record& r : limited(records, RecordSettings())) {
        EXPECT_TRUE(std::isfinite(r.spacing_radius) && r.spacing_radius > 0.0f);
        EXPECT_TRUE(r.gradient_scale >= 0.0f && r.gradient_scale <= 1.0f) << r.gradient_scale;
    }
    EXPECT_TRUE(limited({}, RecordSettings()).empty());
}

TEST(LimitSpacing, ScalesWithTheScene)
{
    const RecordSettings options;
    const std::vector<Record> records = random_records(500, 7);
    std::vector<Record> larger = records;
    for (Record& r : larger) {  // by a power of two: the same bits
        r.position *= 64.0f;
        r.harmonic_mean_distance *= 64.0f;
        r.gradient_reach *= 64.0f;
        r.footprint *= 64.0f;
    }
    const std::vector<Record> a = limited(records, options), b = limited(larger, options);
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_EQ(b[k].spacing_radius, 64.0f * a[k].spacing_radius);
}

}  // namespace
}  // namespace rcs
