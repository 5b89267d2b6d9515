#include "direct/drawn_light.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "direct/direct.h"
#include "support/floor_points.h"
#include "support/scenes.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kSide = 32;

/// A picture of kSide x kSide points of an even floor, `apart` apart [m].
GBuffer floor_picture(float apart)
{
    std::vector<glm::vec2> points;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            points.emplace_back(apart * static_cast<float>(x), apart * static_cast<float>(y));
    GBuffer g = test::points_on_floor(points);
    g.width = g.height = kSide;
    return g;
}

/// `light` with noise of each pixel's own, which is known.
DirectLightResult noisy(const std::vector<float>& light, float error)
{
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0.0f, error);
    DirectLightResult result;
    for (const float l : light) result.irradiance.emplace_back(l + noise(random));
    result.irradiance_error.assign(light.size(), error);
    return result;
}

double off_by(const std::vector<float>& light, const DirectLightResult& found)
{
    double sum = 0.0;
    for (std::size_t i = 0; i < light.size(); ++i) {
        const auto difference = static_cast<double>(luminance(found.irradiance[i]) - light[i]);
        sum += difference * difference / static_cast<double>(light.size());
    }
    return std::sqrt(sum);
}

TEST(DrawnLight, OfOneSurfaceIsPutTogether)
{
    const GBuffer g = floor_picture(0.02f);
    std::vector<float> light;
    for (int i = 0; i < kSide * kSide; ++i) light.push_back(1.0f + 0.01f * static_cast<float>(i % kSide));
    DirectLightResult found = noisy(light, 0.15f);
    ThreadPool pool(2);
    put_together(g, {}, pool, found);
    const double after = off_by(light, found);
    EXPECT_LT(after, 0.3 * 0.15);
    double said = 0.0;
    for (const float error : found.irradiance_error)
        said += static_cast<double>(error * error) / static_cast<double>(light.size());
    EXPECT_NEAR(std::sqrt(said), after, 0.3 * after) << "errors say what is left";
}

TEST(DrawnLight, KeepsEdges)
{
    const GBuffer g = floor_picture(0.02f);
    std::vector<float> light;
    for (int i = 0; i < kSide * kSide; ++i) light.push_back(i % kSide < kSide / 2 ? 0.2f : 2.0f);
    DirectLightResult found = noisy(light, 0.1f);
    ThreadPool pool(2);
    put_together(g, {}, pool, found);
    for (std::size_t i = 0; i < light.size(); ++i)
        EXPECT_NEAR(luminance(found.irradiance[i]), light[i], 0.45f) << i % kSide;
    EXPECT_LT(off_by(light, found), 0.1);
}

TEST(DrawnLight, OtherSurfacesHaveNoPartInIt)
{
    GBuffer g = floor_picture(0.02f);
    std::vector<float> light;
    for (int i = 0; i < kSide * kSide; ++i) {
        const bool is_step = i % kSide >= kSide / 2;
        light.push_back(is_step ? 1.1f : 1.0f);
        if (is_step) g.position_y[static_cast<std::size_t>(i)] = 0.1f;
    }
    DirectLightResult found = noisy(light, 0.15f);
    ThreadPool pool(2);
    put_together(g, {}, pool, found);
    double low = 0.0, high = 0.0;
    for (int y = 0; y < kSide; ++y) {
        const std::size_t edge = static_cast<std::size_t>(y * kSide + kSide / 2);
        low += static_cast<double>(luminance(found.irradiance[edge - 1])) / kSide;
        high += static_cast<double>(luminance(found.irradiance[edge])) / kSide;
    }
    EXPECT_NEAR(low, 1.0, 0.03);
    EXPECT_NEAR(high, 1.1, 0.03);
}

TEST(DrawnLight, ExactLightAndPixelsThatKeepTheirsStay)
{
    const GBuffer g = floor_picture(0.02f);
    std::vector<float> light;
    for (int i = 0; i < kSide * kSide; ++i) light.push_back(1.0f + 0.3f * std::sin(static_cast<float>(i)));
    ThreadPool pool(2);
    DirectLightResult exact = noisy(light, 0.0f);
    put_together(g, {}, pool, exact);
    EXPECT_LT(off_by(light, exact), 1e-6);
    const DirectLightResult before = noisy(light, 0.2f);
    DirectLightResult after = before;
    std::vector<std::uint8_t> keeps(light.size(), 0);
    keeps[100] = 1;
    put_together(g, keeps, pool, after);
    EXPECT_EQ(after.irradiance[100], before.irradiance[100]);
    EXPECT_NE(after.irradiance[101], before.irradiance[101]);
    EXPECT_EQ(after.apart.irradiance, before.irradiance);
}

/// Below a hundred small lamps and slats.
TEST(DrawnLight, OfManyLampsIsLessNoisyAndAsBright)
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    test::add_mesh(scene, test::quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, grey));
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(5.0f));
    for (int i = 0; i < 100; ++i) {
        const float x = 0.4f * static_cast<float>(i / 10) - 2.0f, z = 0.4f * static_cast<float>(i % 10) - 2.0f;
        test::add_mesh(scene, test::quad({x, 2.0f, z}, {0.1f, 0, 0}, {0, 0, 0.1f}, lamp));
        if (i % 10 == 0) test::add_mesh(scene, test::quad({x + 0.2f, 1.5f, -3.0f}, {0, 0.3f, 0}, {0, 0, 6.0f}, grey));
    }
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const GBuffer g = floor_picture(0.02f);
    const auto light = [&](bool together, int samples, std::uint64_t seed, int threads) {
        ThreadPool some(threads);
        DirectSettings settings;
        settings.together = together;
        settings.penumbra_samples = settings.area_samples = samples;
        settings.seed = seed;
        std::uint64_t shadow_rays = 0;
        return direct_light(rays, g, View{}, Shading{}, settings, some, shadow_rays);
    };
    const DirectLightResult truth = light(false, 1024, 9, 2), alone = light(false, 16, 1, 2),
                            together = light(true, 16, 1, 2), other = light(true, 16, 1, 3);
    std::vector<float> expected;
    double mean = 0.0, found = 0.0;
    for (std::size_t i = 0; i < g.size(); ++i) {
        expected.push_back(luminance(truth.irradiance[i]));
        mean += static_cast<double>(expected.back());
        found += static_cast<double>(luminance(together.irradiance[i]));
    }
    EXPECT_LT(off_by(expected, together), 0.7 * off_by(expected, alone));
    EXPECT_NEAR(found, mean, 0.01 * mean);
    EXPECT_EQ(together.irradiance, other.irradiance);
}

}  // namespace
}  // namespace rcs
