// Pixels whose lobes look about the same way put together what rays along them found.
#include "glossy/lobes_together.h"

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "glossy/further_lobes.h"
#include "support/metal_wall.h"
#include "util/color.h"

namespace rcs {
namespace {

using test::MetalWall;

constexpr int kSize = MetalWall::kSize;
constexpr std::size_t kPixels = MetalWall::kPixels;

/// Of lobes that reflect `light` of it all alike, with noise of each pixel's own, which is known.
TracedLight noisy(const std::vector<float>& light, float error)
{
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0.0f, error);
    TracedLight found;
    for (const float l : light) found.radiance.emplace_back(l + noise(random));
    found.error.assign(kPixels, error);
    found.reflectance.assign(kPixels, glm::vec3(1.0f));
    found.distance.assign(kPixels, 2.0f);
    return found;
}

double off_by(const MetalWall& place, const std::vector<float>& light, const TracedLight& found)
{
    double sum = 0.0, count = 0.0;
    for (std::size_t i = 0; i < kPixels; ++i) {
        if (!place.is_traced(i)) continue;
        const auto difference = static_cast<double>(luminance(found.radiance[i]) - light[i]);
        sum += difference * difference;
        count += 1.0;
    }
    return std::sqrt(sum / count);
}

TEST(LobesTogether, FindWhatRaysFindWithLessNoise)
{
    MetalWall place(0.35f);
    const TracedLight truth = place.trace({.rays_per_pixel = 1024, .seed = 77});
    double apart = 0.0, together = 0.0, said = 0.0, mean = 0.0, mean_apart = 0.0;
    constexpr int kSeeds = 8;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        TracedLight light = place.trace({.rays_per_pixel = 16, .seed = seed});
        put_together(place.points, place.shading, place.pool, light);
        double sum = 0.0, sum_apart = 0.0, of_truth = 0.0;
        for (std::size_t i = 0; i < kPixels; ++i) {
            const auto l = static_cast<double>(luminance(truth.radiance[i]));
            apart += std::pow(static_cast<double>(luminance(light.apart.radiance[i])) - l, 2.0);
            together += std::pow(static_cast<double>(luminance(light.radiance[i])) - l, 2.0);
            said += std::pow(static_cast<double>(light.error[i]), 2.0);
            sum += static_cast<double>(luminance(light.radiance[i]));
            sum_apart += static_cast<double>(luminance(light.apart.radiance[i]));
            of_truth += l;
        }
        mean += sum / of_truth / kSeeds;
        mean_apart += sum_apart / of_truth / kSeeds;
    }
    EXPECT_LT(std::sqrt(together), 0.5 * std::sqrt(apart));
    EXPECT_NEAR(std::sqrt(said / together), 1.2, 0.4) << "errors say what is left";
    EXPECT_NEAR(mean, mean_apart, 0.01);
}

TEST(LobesTogether, AMirrorStaysSharp)
{
    MetalWall place(0.0f);
    TracedLight light = place.trace({.rays_per_pixel = 4, .seed = 3});
    const TracedLight before = light;
    put_together(place.points, place.shading, place.pool, light);
    EXPECT_EQ(light.radiance, before.radiance);
    EXPECT_EQ(light.error, before.error);
}

TEST(LobesTogether, KeepsEdges)
{
    MetalWall place(0.35f);
    std::vector<float> light;
    for (std::size_t i = 0; i < kPixels; ++i) light.push_back(i % kSize < kSize / 2 ? 0.2f : 2.0f);
    TracedLight found = noisy(light, 0.1f);
    put_together(place.points, place.shading, place.pool, found);
    for (std::size_t i = 0; i < kPixels; ++i) {
        if (!place.is_traced(i)) continue;
        EXPECT_NEAR(luminance(found.radiance[i]), light[i], 0.45f) << i % kSize;
    }
    EXPECT_LT(off_by(place, light, found), 0.08);
}

TEST(LobesTogether, TellsAlbedoFromLight)
{
    MetalWall place(0.35f);
    TracedLight found = noisy(std::vector<float>(kPixels, 1.0f), 0.2f);
    for (std::size_t i = 0; i < kPixels; ++i) {  // stripes of paint, a pixel wide
        const float part = i % 2 == 0 ? 0.1f : 0.9f;
        found.radiance[i] *= part, found.error[i] *= part, found.reflectance[i] *= part;
    }
    put_together(place.points, place.shading, place.pool, found);
    for (std::size_t i = 0; i < kPixels; ++i) {
        if (!place.is_traced(i)) continue;
        EXPECT_NEAR(luminance(found.radiance[i]) / luminance(found.reflectance[i]), 1.0f, 0.25f) << i % kSize;
    }
}

TEST(LobesTogether, RoundsAreAveragedAsEachPixelFoundThem)
{
    MetalWall place(0.35f);
    const std::vector<float> light(kPixels, 1.0f);
    TracedLight whole = noisy(light, 0.2f), steps = whole;
    const TracedLight more = noisy(light, 0.3f);
    add_round(whole, more);
    put_together(place.points, place.shading, place.pool, whole);
    put_together(place.points, place.shading, place.pool, steps);
    add_round(steps, more);
    put_together(place.points, place.shading, place.pool, steps);
    EXPECT_EQ(whole.radiance, steps.radiance);
    EXPECT_EQ(whole.error, steps.error);
}

}  // namespace
}  // namespace rcs
