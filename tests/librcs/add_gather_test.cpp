#include <cmath>
#include <cstddef>
#include <limits>

#include <gtest/gtest.h>

#include "records/known_record.h"

namespace rcs {
namespace {

Record gathered(float irradiance, float noise, int rays)
{
    Record r;
    r.irradiance = irradiance * glm::vec3(1.0f, 2.0f, 4.0f);
    for (std::size_t c = 0; c < 3; ++c) {
        r.rotation_gradient[c] = irradiance * glm::vec3(1.0f, 0.0f, -static_cast<float>(c));
        r.translation_gradient[c] = irradiance * glm::vec3(0.0f, static_cast<float>(c), 3.0f);
    }
    r.radiance = {irradiance, 3.0f * irradiance};
    r.noise = noise;
    r.rays = rays;
    return r;
}

TEST(AddGather, AveragesByNumbersOfRaysAndCombinesTheErrors)
{
    // Sigma of the mean, a quarter of the one and three quarters of the other, over a mean of 4.
    Record mean = gathered(1.0f, 0.5f, 100);
    add_gather(mean, gathered(5.0f, 0.2f, 300));
    for (int c = 0; c < 3; ++c) {
        const std::size_t i = static_cast<std::size_t>(c);
        EXPECT_NEAR(mean.irradiance[c], 4.0f * gathered(1.0f, 0.0f, 1).irradiance[c], 1e-5f);
        EXPECT_NEAR(glm::distance(mean.rotation_gradient[i], glm::vec3(4.0f, 0.0f, -4.0f * static_cast<float>(c))),
                    0.0f, 1e-5f);
        EXPECT_NEAR(glm::distance(mean.translation_gradient[i], glm::vec3(0.0f, 4.0f * static_cast<float>(c), 12.0f)),
                    0.0f, 1e-5f);
    }
    EXPECT_NEAR(mean.radiance[0], 4.0f, 1e-5f);
    EXPECT_NEAR(mean.radiance[1], 12.0f, 1e-5f);
    EXPECT_NEAR(mean.noise, std::hypot(0.25 * 0.5 * 1.0, 0.75 * 0.2 * 5.0) / 4.0, 1e-6);
    EXPECT_EQ(mean.rays, 400);
}

TEST(AddGather, KeepsWhatTheSpacingRestsOn)
{
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (const float distance : {3.0f, kInfinity, 0.0f}) {
        Record first = gathered(1.0f, 0.5f, 128);
        first.harmonic_mean_distance = first.minimum_distance = first.gradient_reach = distance;
        first.spacing_radius = 0.25f;
        first.gradient_scale = 0.5f;
        Record more = gathered(2.0f, 0.1f, 128);
        more.harmonic_mean_distance = more.minimum_distance = more.gradient_reach = 7.0f;
        add_gather(first, more);
        EXPECT_EQ(first.harmonic_mean_distance, distance);
        EXPECT_EQ(first.minimum_distance, distance);
        EXPECT_EQ(first.gradient_reach, distance);
        EXPECT_EQ(first.spacing_radius, 0.25f);
        EXPECT_EQ(first.gradient_scale, 0.5f);
    }
}

TEST(AddGather, OfDarknessIsDarkWithoutNoise)
{
    Record mean = gathered(0.0f, 0.0f, 128);
    add_gather(mean, gathered(0.0f, 0.0f, 256));
    EXPECT_EQ(mean.irradiance, glm::vec3(0.0f));
    EXPECT_EQ(mean.noise, 0.0f);
}

}  // namespace
}  // namespace rcs
