#include "rcs/direct_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rays/surface.h"
#include "rcs/error.h"
#include "support/floor_points.h"
#include "support/scenes.h"

namespace rcs {
namespace {

/// A floor at y = 0 (instance 0), 20 m wide, that faces up.
Scene floor_scene()
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    test::add_mesh(scene, test::quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, grey));
    return scene;
}

/// Adds a lamp [x0, x1] x [z0, z1] at height h that shines downwards.
void add_lamp(Scene& scene, glm::vec2 low, glm::vec2 high, float h, float radiance)
{
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(radiance));
    test::add_mesh(scene, test::quad({low.x, h, low.y}, {high.x - low.x, 0, 0}, {0, 0, high.y - low.y}, lamp));
}

std::vector<glm::vec2> random_points(int count, float extent, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> coordinate(-extent, extent);
    std::vector<glm::vec2> points;
    for (int i = 0; i < count; ++i) {
        const float x = coordinate(random);
        points.emplace_back(x, coordinate(random));
    }
    return points;
}

std::vector<glm::vec3> light(const Scene& scene, const GBuffer& gbuffer, const DirectSettings& options = {},
                             int threads = 2)
{
    ThreadPool pool(threads);
    const RayScene rays = build_ray_scene(scene, pool);
    std::uint64_t shadow_rays = 0;
    return direct_irradiance(rays, gbuffer, options, pool, shadow_rays);
}

TEST(DirectIrradiance, OfAnUnblockedRectangleIsLambertsFormulaAtEveryPoint)
{
    Scene scene = floor_scene();
    add_lamp(scene, {-0.7f, -1.1f}, {1.4f, 0.3f}, 1.5f, 4.0f);
    const std::vector<glm::vec2> points = random_points(1000, 5.0f, 1);
    const std::vector<glm::vec3> e = light(scene, test::points_on_floor(points));
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double x = static_cast<double>(points[i].x), z = static_cast<double>(points[i].y);
        const double expected = 4.0 * test::rectangle_irradiance(-0.7 - x, 1.4 - x, -1.1 - z, 0.3 - z, 1.5);
        // No sampling noise at all: float arithmetic of the closed form.
        ASSERT_NEAR(static_cast<double>(e[i].r), expected, 1e-4 * expected) << x << ' ' << z;
    }
}

TEST(DirectIrradiance, OfSeveralUnblockedLampsAddsUp)
{
    Scene scene = floor_scene();
    add_lamp(scene, {-3.0f, -1.0f}, {-2.0f, 1.0f}, 2.0f, 3.0f);
    add_lamp(scene, {1.0f, 0.0f}, {2.0f, 1.0f}, 2.5f, 5.0f);
    const std::vector<glm::vec2> points = random_points(300, 2.0f, 2);
    const std::vector<glm::vec3> e = light(scene, test::points_on_floor(points));
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double x = static_cast<double>(points[i].x), z = static_cast<double>(points[i].y);
        const double expected = 3.0 * test::rectangle_irradiance(-3 - x, -2 - x, -1 - z, 1 - z, 2.0) +
                                5.0 * test::rectangle_irradiance(1 - x, 2 - x, -z, 1 - z, 2.5);
        // Triangles that bring less than 2 % together share a sample: the sum then errs by up to that.
        ASSERT_NEAR(static_cast<double>(e[i].g), expected, 0.02 * expected) << x << ' ' << z;
    }
}

/// Irradiance of a lamp square of radiance 1 at height 2, side 2, half behind a blocker x > 0 at height 1,
/// by a midpoint sum over the lamp.
double half_blocked(double x, double z)
{
    const int n = 1000;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
        const double lx = -1.0 + 2.0 * (i + 0.5) / n;
        if (0.5 * (x + lx) > 0.0) continue;  // where the line to the lamp is 1 m high
        for (int j = 0; j < n / 4; ++j) {
            const double lz = -1.0 + 2.0 * (j + 0.5) / (n / 4);
            const double d2 = (lx - x) * (lx - x) + (lz - z) * (lz - z) + 4.0;
            sum += 4.0 / (d2 * d2);  // cos cos' / d^2
        }
    }
    return sum * 4.0 / (n * (n / 4));
}

Scene half_blocked_scene()
{
    Scene scene = floor_scene();
    add_lamp(scene, {-1.0f, -1.0f}, {1.0f, 1.0f}, 2.0f, 1.0f);
    test::add_mesh(scene, test::quad({0.0f, 1.0f, -50.0f}, {50.0f, 0, 0}, {0, 0, 100.0f}, 0));
    return scene;
}

/// Errors at random points of the penumbra, relative to what the lamp sends if nothing blocks it.
struct Deviation {
    double mean = 0.0, largest = 0.0, ratio_of_means = 0.0;
    double of_random_rays = 0.0;  ///< expected mean if as many rays were independent, standard deviation x sqrt(2/pi)
};
Deviation deviation(const DirectSettings& options, int count)
{
    const std::vector<glm::vec2> points = random_points(count, 1.5f, 3);
    const std::vector<glm::vec3> e = light(half_blocked_scene(), test::points_on_floor(points), options);
    Deviation d;
    double got = 0.0, wanted = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double x = static_cast<double>(points[i].x), z = static_cast<double>(points[i].y);
        const double whole = test::rectangle_irradiance(-1 - x, 1 - x, -1 - z, 1 - z, 2.0);
        const double expected = half_blocked(x, z);
        const double seen = std::clamp(expected / whole, 0.0, 1.0);
        const double error = std::abs(static_cast<double>(e[i].r) - expected) / whole;
        d.mean += error / count;
        d.of_random_rays += std::sqrt(2.0 / std::numbers::pi * seen * (1.0 - seen) /
                                      (options.area_samples + options.penumbra_samples)) /
                            count;
        d.largest = std::max(d.largest, error);
        got += static_cast<double>(e[i].r);
        wanted += expected;
    }
    d.ratio_of_means = got / wanted;
    return d;
}

TEST(DirectIrradiance, InPenumbraConvergesToTheBruteForceSum)
{
    DirectSettings many;
    many.area_samples = 256;
    many.penumbra_samples = 4096;
    const Deviation d = deviation(many, 60);
    EXPECT_LT(d.largest, 0.005);
    EXPECT_LT(d.mean, 0.2 * d.of_random_rays) << "a lattice resolves an edge better than chance";
    EXPECT_NEAR(d.ratio_of_means, 1.0, 0.001);
}

TEST(DirectIrradiance, InPenumbraAtDefaultsIsUnbiasedAndAsGoodAsRandomRays)
{
    const Deviation d = deviation({}, 400);
    // What the lattice gains over chance is lost again where the few first rays miss a narrow part.
    EXPECT_LT(d.mean, 1.2 * d.of_random_rays);
    // 400 points, each off by 3 % of the whole lamp, of which they see a half: 0.3 %; here twice that.
    EXPECT_NEAR(d.ratio_of_means, 1.0, 0.006);
}

/// Slats that hide nine tenths of a lamp from everywhere: its few first rays mostly say that it is hidden.
TEST(DirectIrradiance, ThroughNarrowSlitsIsUnbiased)
{
    Scene scene = floor_scene();
    add_lamp(scene, {-2.0f, -2.0f}, {2.0f, 2.0f}, 4.0f, 1.0f);
    for (int slat = -100; slat < 100; ++slat)
        test::add_mesh(scene,
                       test::quad({0.1f * static_cast<float>(slat), 2.0f, -10.0f}, {0.09f, 0, 0}, {0, 0, 20.0f}, 0));
    const std::vector<glm::vec2> points = random_points(400, 1.0f, 6);
    const auto mean = [&](const DirectSettings& options) {
        double sum = 0.0;
        for (const glm::vec3 e : light(scene, test::points_on_floor(points), options))
            sum += static_cast<double>(e.r) / static_cast<double>(points.size());
        return sum;
    };
    DirectSettings many;
    many.area_samples = many.penumbra_samples = 1024;
    // 400 points, whose 80 rays each leave 30 % of noise.
    EXPECT_NEAR(mean({}) / mean(many), 1.0, 0.045);
}

/// Lamps of very different brightness, the brightest behind a screen.
TEST(DirectIrradiance, OfAFewPickedLampsIsThatOfAllOnAverage)
{
    Scene scene = floor_scene();
    for (int k = 0; k < 9; ++k) {
        const glm::vec2 low(-3.0f + 2.2f * static_cast<float>(k % 3), -3.0f + 2.2f * static_cast<float>(k / 3));
        add_lamp(scene, low, low + 0.4f, 2.5f, 1.0f + static_cast<float>(k * k));
    }
    test::add_mesh(scene, test::quad({1.0f, 2.0f, 1.0f}, {2.0f, 0, 0}, {0, 0, 2.0f}, 0));
    const GBuffer points = test::points_on_floor(random_points(20000, 2.5f, 11));
    const auto mean = [&](const DirectSettings& options, std::uint64_t& shadow_rays) {
        ThreadPool pool(2);
        const RayScene rays = build_ray_scene(scene, pool);
        double sum = 0.0;
        for (const glm::vec3 e : direct_irradiance(rays, points, options, pool, shadow_rays))
            sum += static_cast<double>(e.r) / static_cast<double>(points.size());
        return sum;
    };
    std::uint64_t rays_of_all = 0, rays_of_picks = 0;
    const double all = mean({}, rays_of_all);
    for (int picks : {1, 3}) {
        DirectSettings options;
        options.area_samples = options.lamp_picks = picks;
        rays_of_picks = 0;
        // One pick is off by about its own size at each of 20,000 points: 0.7 % of the mean.
        EXPECT_NEAR(mean(options, rays_of_picks) / all, 1.0, 0.02) << picks;
        EXPECT_EQ(rays_of_picks, points.size() * static_cast<std::size_t>(picks));
    }
    EXPECT_GT(rays_of_all, 8u * points.size());
}

TEST(DirectIrradiance, OfPunctualLightsIsTheirFormula)
{
    Scene scene = floor_scene();
    PunctualLight point = test::point_light({0.5, 2.0, -0.3}, {3.0f, 2.0f, 1.0f});
    point.range = 6.0f;
    PunctualLight sun;
    sun.kind = LightKind::directional;
    sun.direction = glm::normalize(glm::dvec3(0.3, -1.0, 0.2));
    sun.intensity = {0.5f, 0.6f, 0.7f};
    PunctualLight spot = test::point_light({-1.0, 3.0, 0.0}, {10.0f, 10.0f, 10.0f});
    spot.kind = LightKind::spot;
    spot.direction = {0.0, -1.0, 0.0};
    spot.inner_cone = 0.3f;
    spot.outer_cone = 0.6f;
    scene.lights = {point, sun, spot};
    const std::vector<glm::vec2> points = random_points(1000, 5.0f, 4);
    const std::vector<glm::vec3> e = light(scene, test::points_on_floor(points));
    for (std::size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 p(points[i].x, 0.0, points[i].y);
        glm::dvec3 expected = glm::dvec3(sun.intensity) * -sun.direction.y;
        const double d = glm::distance(point.position, p);
        expected += glm::dvec3(point.intensity) * point.position.y / (d * d * d) *
                    std::clamp(1.0 - std::pow(d / 6.0, 4), 0.0, 1.0);
        const double s = glm::distance(spot.position, p);
        const double cosine = spot.position.y / s;
        const double cone = std::clamp((cosine - std::cos(0.6)) / (std::cos(0.3) - std::cos(0.6)), 0.0, 1.0);
        expected += glm::dvec3(spot.intensity) * cosine / (s * s) * cone * cone;
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(static_cast<double>(e[i][c]), expected[c], 1e-5 * expected[c]) << p.x << ' ' << p.z;
    }
}

TEST(DirectIrradiance, BehindABlockerIsZeroAndBesideItWhole)
{
    Scene scene = floor_scene();
    scene.lights = {test::point_light({0.0, 2.0, 0.0}, glm::vec3(1.0f))};
    test::add_mesh(scene, test::quad({0.0f, 1.0f, -50.0f}, {50.0f, 0, 0}, {0, 0, 100.0f}, 0));
    const std::vector<glm::vec2> points = random_points(1000, 3.0f, 5);
    const std::vector<glm::vec3> e = light(scene, test::points_on_floor(points));
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double d2 = 4.0 + static_cast<double>(glm::dot(points[i], points[i]));
        const double expected = points[i].x > 0.0f ? 0.0 : 2.0 / (d2 * std::sqrt(d2));
        ASSERT_NEAR(static_cast<double>(e[i].r), expected, 1e-5 * expected) << points[i].x;
    }
}

TEST(DirectIrradiance, FromBelowTheHorizonOrBehindALampIsZero)
{
    Scene scene = floor_scene();
    add_lamp(scene, {-1.0f, -1.0f}, {1.0f, 1.0f}, -1.0f, 1.0f);  // under the floor
    scene.lights = {test::point_light({0.0, -0.5, 0.0}, glm::vec3(1.0f))};
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    test::add_mesh(scene, test::quad({-1, 2, -1}, {0, 0, 2}, {2, 0, 0}, lamp));  // shines upwards
    for (const glm::vec3 e : light(scene, test::points_on_floor(random_points(200, 3.0f, 6))))
        ASSERT_EQ(e, glm::vec3(0.0f));
}

TEST(DirectIrradiance, IsNothingWhereNothingIsSeenAndTheSameForAnyNumberOfThreads)
{
    GBuffer g = test::points_on_floor(random_points(5000, 2.0f, 7));
    for (std::size_t i = 0; i < g.size(); i += 3) g.instance[i] = GBuffer::kNone;
    const Scene scene = half_blocked_scene();
    const std::vector<glm::vec3> one = light(scene, g, {}, 1);
    EXPECT_EQ(one, light(scene, g, {}, 2));
    EXPECT_EQ(one, light(scene, g, {}, 3));
    for (std::size_t i = 0; i < g.size(); i += 3) ASSERT_EQ(one[i], glm::vec3(0.0f));
    DirectSettings other;
    other.seed = 2;
    EXPECT_NE(one, light(scene, g, other, 1)) << "the seed matters in the penumbra";
}

TEST(DirectIrradiance, CountsItsShadowRays)
{
    Scene scene = floor_scene();
    scene.lights = {test::point_light({0.0, 2.0, 0.0}, glm::vec3(1.0f))};
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    std::uint64_t shadow_rays = 5;
    direct_irradiance(rays, test::points_on_floor(random_points(300, 3.0f, 8)), {}, pool, shadow_rays);
    EXPECT_EQ(shadow_rays, 305u);
}

constexpr std::uint32_t kFloor = 0, kRoof = 2;

/// A picture whose left half shows the floor below a roof that hides the lamp, and whose right half shows the roof.
GBuffer floor_beside_roof()
{
    constexpr int kSize = 16;
    constexpr float kPixel = 0.01f;
    std::vector<glm::vec2> places;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            places.emplace_back(kPixel * static_cast<float>(x), kPixel * static_cast<float>(y));
    GBuffer g = test::points_on_floor(places);
    g.width = g.height = kSize;
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (i % kSize < kSize / 2) continue;
        g.position_y[i] = 1.0f;
        g.instance[i] = kRoof;
    }
    return g;
}

TEST(DirectIrradiance, TakesNoEdgeOfAThingForAHalfShadow)
{
    Scene scene = floor_scene();
    add_lamp(scene, {-0.5f, -0.5f}, {0.5f, 0.5f}, 3.0f, 2.0f);
    test::add_mesh(scene, test::quad({-5, 1, -5}, {0, 0, 10}, {10, 0, 0}, 0));
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const auto shot_without = [&](std::uint32_t left_out) {
        GBuffer g = floor_beside_roof();
        std::replace(g.instance.begin(), g.instance.end(), left_out, GBuffer::kNone);
        std::uint64_t count = 0;
        const std::vector<glm::vec3> e = direct_irradiance(rays, g, {}, pool, count);
        for (std::size_t i = 0; i < e.size(); ++i) EXPECT_EQ(e[i].r > 0.0f, g.instance[i] == kRoof) << i;
        return count;
    };
    EXPECT_EQ(shot_without(GBuffer::kNone), shot_without(kFloor) + shot_without(kRoof));
}

TEST(DirectIrradiance, RefusesSampleCountsOutOfRangeByName)
{
    const auto message = [](int area, int penumbra, int picks = 0) -> std::string {
        DirectSettings options;
        options.lamp_picks = picks;
        options.area_samples = area;
        options.penumbra_samples = penumbra;
        try {
            light(floor_scene(), test::points_on_floor({{0.0f, 0.0f}}), options);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            return e.what();
        }
        return "no error";
    };
    EXPECT_NE(message(0, 64).find("area_samples is 0"), std::string::npos);
    EXPECT_NE(message(1025, 2000).find("area_samples is 1025"), std::string::npos);
    EXPECT_NE(message(8, 7).find("penumbra_samples is 7"), std::string::npos);
    EXPECT_NE(message(8, 65537).find("penumbra_samples is 65537"), std::string::npos);
    EXPECT_EQ(message(8, 8), "no error");
    EXPECT_NE(message(8, 8, -1).find("lamp_picks is -1"), std::string::npos);
    EXPECT_NE(message(8, 8, 1025).find("lamp_picks is 1025"), std::string::npos);
}

}  // namespace
}  // namespace rcs
