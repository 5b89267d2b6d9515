#include "placement/changes_around.h"

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "shared/weight.h"

namespace rcs {
namespace {

constexpr float kTolerance = 0.2f;

struct Looked {
    std::vector<Record> records, changes;
    std::vector<std::uint32_t> which;

    std::vector<ChangeAround> around(int threads = 2) const
    {
        ThreadPool pool{threads};
        return changes_around(records, which, changes, kTolerance, pool);
    }
};

/// Records about a metre apart on a floor and on a wall, of light 1, that saw nothing change.
Looked on_floor_and_wall(int side)
{
    Looked l;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> beside(-0.4f, 0.4f), spacing(0.7f, 1.3f);
    for (int i = 0; i < side * side; ++i) {
        const float x = static_cast<float>(i % side) + beside(random),
                    y = static_cast<float>(i / side) + beside(random);
        for (const bool wall : {false, true}) {
            Record r;
            r.position = wall ? glm::vec3(x, 0.0f, y) : glm::vec3(x, y, 0.0f);
            r.normal = wall ? glm::vec3(0.0f, 1.0f, 0.0f) : glm::vec3(0.0f, 0.0f, 1.0f);
            r.irradiance = glm::vec3(1.0f);
            r.watch.light = 1.0f;
            r.spacing_radius = spacing(random);
            l.records.push_back(r);
        }
    }
    l.changes.resize(l.records.size());
    l.which.resize(l.records.size());
    std::iota(l.which.begin(), l.which.end(), 0u);
    return l;
}

/// What a record weighs at another, its influence so many spacing radii wide.
double weight_of(const Record& other, const Record& at, float wide)
{
    const glm::vec3 d = at.position - other.position, n = at.normal, n_k = other.normal;
    return static_cast<double>(gpu::rcs_interpolation_weight({d.x, d.y, d.z}, {n.x, n.y, n.z}, {n_k.x, n_k.y, n_k.z},
                                                             1.0f / (wide * other.spacing_radius),
                                                             1.0f / (wide * kTolerance)));
}

TEST(ChangesAround, IsNothingToTheBitWhereNothingHasChanged)
{
    Looked l = on_floor_and_wall(12);
    for (const ChangeAround& there : l.around()) {
        EXPECT_EQ(there.change, 0.0f);
        EXPECT_EQ(there.error, 0.0f);
        EXPECT_EQ(there.mean, glm::vec3(0.0f));
        EXPECT_EQ(there.noise, 0.0f);
        EXPECT_FALSE(there.any());
    }
}

double luminance_of(glm::vec3 light)
{
    return 0.2126 * static_cast<double>(light.r) + 0.7152 * static_cast<double>(light.g) +
           0.0722 * static_cast<double>(light.b);
}

TEST(ChangesAround, IsWhatSumsOverAllPairsSay)
{
    Looked l = on_floor_and_wall(12);
    std::mt19937 random(7);
    std::normal_distribution<float> saw(0.05f, 0.3f);
    for (Record& change : l.changes)
        change.irradiance = {saw(random), saw(random), saw(random)}, change.noise = std::abs(saw(random));
    const std::vector<ChangeAround> found = l.around();
    int large = 0;
    for (std::size_t k = 0; k < l.records.size(); ++k) {
        double nearest = 0.0, squares = 0.0, variance = 0.0;
        glm::dvec3 mean(l.changes[k].irradiance);
        double givers = 1.0, theirs = std::pow(static_cast<double>(l.changes[k].noise), 2.0);
        for (std::size_t j = 0; j < l.records.size(); ++j) {
            if (j == k) continue;
            const Record& change = l.changes[j];
            const double error = static_cast<double>(change.noise);
            const double v = weight_of(l.records[j], l.records[k], 2.0f);
            nearest += v;
            squares += v * std::pow(luminance_of(change.irradiance), 2.0);
            variance += v * error * error;
            if (found[j].change > 0.3f) continue;
            const double w = weight_of(l.records[j], l.records[k], 4.0f);
            mean += w * glm::dvec3(change.irradiance);
            givers += w;
            theirs += w * w * error * error;
        }
        if (found[k].large) {
            ++large;
        } else {
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[k].mean[c], mean[c] / givers, 1e-5);
            EXPECT_NEAR(found[k].noise, std::sqrt(theirs) / givers, 1e-5);
        }
        if (nearest < 0.2) continue;
        EXPECT_NEAR(found[k].change, std::sqrt(squares / nearest) / 1.01, 1e-3) << k;
        EXPECT_NEAR(found[k].error, std::sqrt(variance / nearest) / 1.01, 1e-3) << k;
    }
    EXPECT_GT(large, 20);
    EXPECT_LT(large, 250);
}

TEST(ChangesAround, ALoneRecordIsJudgedByItsOwnWord)
{
    Looked l = on_floor_and_wall(1);
    l.records[1].position.y = 50.0f;
    l.changes[0].irradiance = glm::vec3(0.25f);
    l.changes[0].noise = 0.125f;
    const std::vector<ChangeAround> found = l.around();
    EXPECT_NEAR(found[0].change, 0.25 / 1.01, 1e-5);
    EXPECT_NEAR(found[0].error, 0.125 / 1.01, 1e-5);
    EXPECT_EQ(found[0].mean, glm::vec3(0.25f));
    EXPECT_FALSE(found[0].large);
    EXPECT_FALSE(found[1].any());
    l.changes[0].irradiance = glm::vec3(0.5f);
    EXPECT_TRUE(l.around()[0].large);
}

TEST(ChangesAround, WhatOneRecordSeesBeyondDoubtIsLargeThere)
{
    Looked l = on_floor_and_wall(12);
    const std::size_t shadowed = 2 * (6 * 12 + 6);  // on the floor, in the middle
    l.changes[shadowed].irradiance = glm::vec3(-0.6f);
    l.changes[shadowed].noise = 0.1f;
    std::vector<ChangeAround> found = l.around();
    EXPECT_TRUE(found[shadowed].large);
    for (std::size_t k = 0; k < found.size(); ++k) {
        if (k == shadowed) continue;
        EXPECT_FALSE(found[k].large && weight_of(l.records[shadowed], l.records[k], 2.0f) == 0.0) << k;
        EXPECT_GT(found[k].mean.r, -0.12f) << k;
    }
    l.changes[shadowed].noise = 0.5f;  // one ray may have said so
    found = l.around();
    EXPECT_FALSE(found[shadowed].large);
    EXPECT_LT(found[shadowed].mean.r, 0.0f);
}

TEST(ChangesAround, LightThatIsNoLongerWhatItWasGatheredAsIsALargeChange)
{
    Looked l = on_floor_and_wall(12);
    for (Record& change : l.changes) change.irradiance = glm::vec3(-0.05f), change.noise = 0.01f;
    for (const ChangeAround& there : l.around()) EXPECT_FALSE(there.large);
    for (Record& r : l.records) r.irradiance = glm::vec3(0.72f);
    for (const ChangeAround& there : l.around()) EXPECT_TRUE(there.large);
}

// What a tenth is of bright light is too much for a record in the dark among them.
TEST(ChangesAround, ARecordInTheDarkIsJudgedByItsOwnLight)
{
    Looked l = on_floor_and_wall(12);
    const std::size_t dark = 2 * (6 * 12 + 6);
    l.records[dark].irradiance = glm::vec3(0.05f);
    l.records[dark].watch.light = 0.05f;
    for (Record& change : l.changes) change.irradiance = glm::vec3(0.1f), change.noise = 0.01f;
    const std::vector<ChangeAround> found = l.around();
    for (std::size_t k = 0; k < found.size(); ++k) EXPECT_EQ(found[k].large, k == dark) << k;
}

// Light grows by a twentieth everywhere, by a spot that one record of eight finds.
TEST(ChangesAround, WhetherARecordIsToBeGatheredAgainDoesNotDependOnWhatItSawItself)
{
    constexpr float kGrowth = 0.05f, kFound = 0.125f;
    Looked l = on_floor_and_wall(60);
    std::mt19937 random(11);
    std::bernoulli_distribution finds(static_cast<double>(kFound));
    for (Record& change : l.changes)
        if (finds(random)) change.irradiance = glm::vec3(kGrowth / kFound), change.noise = kGrowth / kFound;
    const std::vector<ChangeAround> found = l.around();
    double mean_of_kept = 0.0, taken_on = 0.0, mean = 0.0, own = 0.0, squares = 0.0;
    int kept = 0, by_own = 0;
    for (std::size_t k = 0; k < found.size(); ++k) {
        const auto saw = static_cast<double>(l.changes[k].irradiance.r);
        mean += static_cast<double>(found[k].mean.r);
        squares += std::pow(static_cast<double>(found[k].mean.r) - static_cast<double>(kGrowth), 2.0);
        if (found[k].change < 0.12f) ++kept, mean_of_kept += saw, taken_on += static_cast<double>(found[k].mean.r);
        if (saw < 0.12) ++by_own, own += saw;
    }
    const auto count = static_cast<double>(found.size());
    ASSERT_GT(kept, 1000);
    ASSERT_LT(kept, 6500);
    EXPECT_NEAR(mean_of_kept / kept, static_cast<double>(kGrowth), 0.008) << "of " << kept;
    // Those that judged are part of what is taken on.
    EXPECT_NEAR(taken_on / kept, static_cast<double>(kGrowth), 0.4 * static_cast<double>(kGrowth));
    EXPECT_EQ(own / by_own, 0.0) << "judged by themselves, those that are kept would have missed all";
    EXPECT_NEAR(mean / count, static_cast<double>(kGrowth), 0.005);
    const double alone = static_cast<double>(kGrowth) * std::sqrt(1.0 / static_cast<double>(kFound) - 1.0);
    EXPECT_LT(std::sqrt(squares / count), 0.5 * alone) << "the mean is less noisy than one";
}

TEST(ChangesAround, IsTheSameForAnyNumberOfThreads)
{
    Looked l = on_floor_and_wall(30);
    std::mt19937 random(5);
    std::normal_distribution<float> saw(0.1f, 0.3f);
    for (Record& change : l.changes) change.irradiance = glm::vec3(saw(random)), change.noise = 0.1f;
    const std::vector<ChangeAround> two = l.around(), alone = l.around(1);
    for (std::size_t k = 0; k < two.size(); ++k) {
        EXPECT_EQ(two[k].change, alone[k].change);
        EXPECT_EQ(two[k].mean, alone[k].mean);
    }
}

}  // namespace
}  // namespace rcs
