// Rays along narrow lobes go on where they would show noise, as those around say.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "glossy/further_lobes.h"
#include "glossy/traced_lobes.h"
#include "support/metal_wall.h"
#include "util/color.h"

namespace rcs {
namespace {

using test::MetalWall;

constexpr int kSize = MetalWall::kSize;
constexpr std::size_t kPixels = MetalWall::kPixels;

double sum_of(const TracedLight& light)
{
    double sum = 0.0;
    for (const glm::vec3& radiance : light.radiance) sum += static_cast<double>(luminance(radiance));
    return sum;
}

TEST(FurtherLobes, GoToNoiseThatWouldShow)
{
    const MetalWall place(0.3f);
    const std::vector<float> alone(kPixels, 0.0f), beside(kPixels, 9.0f);
    const auto rounds = [&](float error, const std::vector<float>& other) {
        const std::vector<std::uint8_t> all =
            further_rounds(place.points, place.shading, place.even(error), other, {.allowed = 0.05f, .most = 5});
        int most = 0;
        for (std::size_t i = 0; i < kPixels; ++i) {
            EXPECT_TRUE(place.is_traced(i) || all[i] == 0) << i;
            most = std::max(most, static_cast<int>(all[i]));
        }
        return most;
    };
    EXPECT_EQ(rounds(0.05f, alone), 0);
    EXPECT_EQ(rounds(0.15f, alone), 2) << "three times the noise: three rounds in all";
    EXPECT_EQ(rounds(1.5f, alone), 5) << "no more than there may be";
    EXPECT_EQ(rounds(0.15f, beside), 0) << "hidden in nine times as much other light";
    EXPECT_EQ(rounds(1.5f, beside), 2);
}

TEST(FurtherLobes, WhatIsKnownOfBeforeCountsAsRounds)
{
    const MetalWall place(0.3f);
    TracedLight known = place.even(0.15f);
    known.variance.assign(kPixels, 0.25f);  // .3 by one round: six are wanted, and four were had
    const std::vector<std::uint8_t> rounds =
        further_rounds(place.points, place.shading, known, std::vector<float>(kPixels, 0.0f), {0.05f, 5});
    for (std::size_t i = 0; i < kPixels; ++i) EXPECT_EQ(rounds[i], place.is_traced(i) ? 2 : 0) << i;
}

TEST(FurtherLobes, APixelsOwnLuckDoesNotSayWhatItGets)
{
    const MetalWall place(0.3f);
    TracedLight light = place.even(0.15f);
    const std::size_t lucky = kPixels / 2 + kSize / 2 + 5;
    ASSERT_TRUE(place.is_traced(lucky));
    const std::vector<float> alone(kPixels, 0.0f);
    light.radiance[lucky] = glm::vec3(50.0f);
    light.error[lucky] = 40.0f;
    const std::vector<std::uint8_t> rounds =
        further_rounds(place.points, place.shading, light, alone, {.allowed = 0.05f, .most = 5});
    EXPECT_EQ(rounds[lucky], rounds[lucky + 1]);
    EXPECT_EQ(rounds[lucky], rounds[lucky + kSize]);
}

TEST(FurtherLobes, OnlyThosePixelsAreTracedThatAreToBe)
{
    MetalWall place(0.3f);
    std::vector<std::uint8_t> only(kPixels, 0);
    std::size_t count = 0, traced = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
        only[i] = i % kSize < kSize / 3 ? 1 : 0;
        traced += place.is_traced(i) ? 1 : 0;
        count += place.is_traced(i) && only[i] != 0 ? 1 : 0;
    }
    ASSERT_GT(count, 100u);
    ASSERT_LT(count, traced / 2);
    GlossyStats some, all;
    const TracedLight light = place.trace({.rays_per_pixel = 8, .seed = 5, .only = &only}, some);
    place.trace({.rays_per_pixel = 8, .seed = 5}, all);
    EXPECT_LE(some.rays, 8 * count);
    EXPECT_GT(some.rays, 6 * count) << "but for those below the horizon";
    EXPECT_GT(all.rays, 6 * traced);
    for (std::size_t i = 0; i < kPixels; ++i) EXPECT_TRUE(only[i] != 0 || light.radiance[i] == glm::vec3(0.0f)) << i;
}

TEST(FurtherLobes, RoundsCountAlike)
{
    const MetalWall place(0.3f);
    TracedLight light = place.even(0.3f), more = place.even(0.3f);
    more.radiance.assign(kPixels, glm::vec3(4.0f));
    std::vector<std::uint8_t> had(kPixels, 1);
    had[7] = 0;
    add_round(light, more, &had);
    add_round(light, more, &had);
    EXPECT_FLOAT_EQ(light.radiance[3].g, 3.0f) << "one of 1 and two of 4";
    EXPECT_FLOAT_EQ(light.error[3], 0.3f / std::sqrt(3.0f));
    EXPECT_FLOAT_EQ(light.variance[3], 1.0f / 3.0f);
    EXPECT_EQ(light.radiance[7].g, 1.0f);
    EXPECT_EQ(light.error[7], 0.3f);
}

TEST(FurtherLobes, WhatWasSampledAgainIsAveragedAsThePixelsAre)
{
    const MetalWall place(0.3f);
    TracedLight light = place.even(0.3f), more = place.even(0.3f);
    light.again = {{.pixel = 3, .radiance = {glm::vec3(1.0f), glm::vec3(2.0f)}}, {}};
    more.again = {{.pixel = 3, .radiance = {glm::vec3(4.0f), glm::vec3(5.0f)}}, {}};
    add_round(light, more);
    add_round(light, more);
    EXPECT_FLOAT_EQ(light.again[0].radiance[0].g, 3.0f);
    EXPECT_FLOAT_EQ(light.again[0].radiance[1].g, 4.0f);
    add_round(light, place.even(0.3f));  // of a round that sampled nothing again it stays as it is
    EXPECT_FLOAT_EQ(light.again[0].radiance[0].g, 3.0f);
}

TEST(FurtherLobes, LeaveLessNoiseAndTheSameMean)
{
    MetalWall place(0.35f);
    const TracedLight truth = place.trace({.rays_per_pixel = 2048, .seed = 77});
    const std::vector<float> alone(kPixels, 0.0f);
    double first = 0.0, further = 0.0, mean = 0.0, squares = 0.0;
    constexpr int kSeeds = 24;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        TracedLight light = place.trace({.rays_per_pixel = 4, .seed = seed});
        const auto off = [&] {
            double sum = 0.0;
            for (std::size_t i = 0; i < kPixels; ++i)
                sum += static_cast<double>(std::abs(luminance(light.radiance[i]) - luminance(truth.radiance[i])));
            return sum;
        };
        first += off();
        std::vector<std::uint8_t> left =
            further_rounds(place.points, place.shading, light, alone, {.allowed = 0.05f, .most = 6});
        for (std::uint64_t round = 1; round <= 6; ++round) {
            add_round(light, place.trace({.rays_per_pixel = 4, .seed = 1000 * round + seed, .only = &left}), &left);
            for (std::uint8_t& rounds : left) rounds = static_cast<std::uint8_t>(rounds > 0 ? rounds - 1 : 0);
        }
        further += off();
        const double ratio = sum_of(light) / sum_of(truth);
        mean += ratio / kSeeds;
        squares += ratio * ratio / kSeeds;
    }
    EXPECT_LT(further, 0.75 * first);
    const double error = std::sqrt(std::max(0.0, squares - mean * mean) / (kSeeds - 1));
    EXPECT_LT(error, 0.007);
    EXPECT_NEAR(mean, 1.0, 0.003 + 3.0 * error);
}

}  // namespace
}  // namespace rcs
