#include "direct/direct.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "direct/direct_point.h"
#include "hit_light/hit_light.h"
#include "support/lobes.h"
#include "support/scenes.h"

namespace rcs {
namespace {

/// A floor at y = 0 with a lamp of radiance 5 above it, [-0.5, 0.5] x [-2, -1] at height 1.5, that shines downwards.
Scene lamp_scene()
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(5.0f));
    test::add_mesh(scene, test::quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, grey));
    test::add_mesh(scene, test::quad({-0.5f, 1.5f, -2.0f}, {1, 0, 0}, {0, 0, 1}, lamp));
    return scene;
}

SurfacePoint floor_point(float x, float z)
{
    SurfacePoint p{};
    p.position = {x, 0.0f, z};
    p.position_error = 1e-5f;
    p.geometric_normal = p.shading_normal = {0, 1, 0};
    return p;
}

Bsdf metal(float alpha) { return test::surface_of({make_lobe<Specular>({0.9f, 0.6f, 0.3f}, 1.0f, alpha)}, {0, 1, 0}); }

/// The mean of many independent estimates at a point, and their standard deviation relative to it.
struct Estimate {
    glm::dvec3 mean{0.0};
    double deviation = 0.0;
};
Estimate estimate(const Scene& scene, const SurfacePoint& point, const Bsdf& bsdf, glm::vec3 outgoing, int count)
{
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const DirectLight light(rays, {});
    DirectLight::Workspace w;
    Estimate e;
    double square = 0.0;
    for (int i = 0; i < count; ++i) {
        const Lit lit = light.at(point, {&bsdf, outgoing}, mix64(static_cast<std::uint64_t>(i)), w);
        e.mean += glm::dvec3(lit.glossy) / static_cast<double>(count);
        square += static_cast<double>(lit.glossy.r) * static_cast<double>(lit.glossy.r) / count;
    }
    e.deviation = std::sqrt(std::max(0.0, square - e.mean.r * e.mean.r)) / e.mean.r;
    return e;
}

/// The lamp's light by a midpoint sum over its area.
glm::dvec3 by_area(const SurfacePoint& point, const Bsdf& bsdf, glm::vec3 outgoing, int n)
{
    glm::dvec3 sum(0.0);
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            const glm::vec3 at(-0.5f + (static_cast<float>(i) + 0.5f) / static_cast<float>(n), 1.5f,
                               -2.0f + (static_cast<float>(j) + 0.5f) / static_cast<float>(n));
            const glm::vec3 d = at - point.position;
            const glm::vec3 w = glm::normalize(d);
            const double solid_angle = static_cast<double>(w.y / glm::dot(d, d)) / (static_cast<double>(n) * n);
            sum += glm::dvec3(evaluate(bsdf, outgoing, w)) * static_cast<double>(w.y) * 5.0 * solid_angle;
        }
    }
    return sum;
}

TEST(GlossyDirectLight, IsTheIntegralOverTheLampAtEveryRoughness)
{
    const SurfacePoint point = floor_point(0.1f, 0.2f);
    // The mirror direction meets the lamp near its middle.
    const glm::vec3 outgoing = glm::normalize(glm::vec3(0.0f, 1.5f, 1.7f));
    for (const float alpha : {0.02f, 0.05f, 0.1f, 0.2f, 0.3f, 0.5f, 0.7f, 1.0f}) {
        const glm::dvec3 expected = by_area(point, metal(alpha), outgoing, alpha < 0.1f ? 2000 : 500);
        const Estimate e = estimate(lamp_scene(), point, metal(alpha), outgoing, 4000);
        // 5 standard errors of the mean, and what the sum misses.
        const double tolerance = 5.0 * e.deviation / std::sqrt(4000.0) + 2e-3;
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(e.mean[c] / expected[c], 1.0, tolerance) << alpha << ' ' << c;
        // Clean in a single picture: no estimate is off by more than a few percent as a rule.
        EXPECT_LT(e.deviation, 0.12) << alpha;
        RecordProperty("deviation_" + std::to_string(alpha), std::to_string(e.deviation));
    }
}

TEST(GlossyDirectLight, AMirrorShowsTheLampOrNothing)
{
    Bsdf mirror = metal(kLeastAlpha);
    const SurfacePoint point = floor_point(0.1f, 0.2f);
    const glm::vec3 hit = glm::normalize(glm::vec3(0.0f, 1.5f, 1.7f)),
                    miss = glm::normalize(glm::vec3(0.0f, 1.5f, 0.2f));
    const Estimate seen = estimate(lamp_scene(), point, mirror, hit, 200);
    const glm::vec3 albedo = test::specular_albedo(mirror, hit.y);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen.mean[c], 5.0 * static_cast<double>(albedo[c]), 0.02 * seen.mean[c]);
    EXPECT_LT(seen.deviation, 0.03);
    const Estimate dark = estimate(lamp_scene(), point, mirror, miss, 200);
    EXPECT_LT(dark.mean.r, 1e-3);
}

TEST(GlossyDirectLight, BlockedLampsHaveNoHighlight)
{
    Scene scene = lamp_scene();
    test::add_mesh(scene, test::quad({-5, 1, -5}, {10, 0, 0}, {0, 0, 10}, 0));
    for (const float alpha : {0.01f, 0.2f, 0.8f}) {
        ThreadPool pool(1);
        const RayScene rays = build_ray_scene(scene, pool);
        const DirectLight light(rays, {});
        DirectLight::Workspace w;
        const Bsdf bsdf = metal(alpha);
        const Lit lit = light.at(floor_point(0, 0), {&bsdf, glm::normalize(glm::vec3(0, 1, 1))}, 1, w);
        EXPECT_EQ(lit.glossy, glm::vec3(0.0f));
        EXPECT_EQ(lit.irradiance, glm::vec3(0.0f));
    }
}

TEST(DirectLight, ALampDoesNotLightItself)
{
    Scene scene;
    const int lamp = test::add_material(scene, glm::vec3(0.5f), glm::vec3(5.0f), true);
    test::add_mesh(scene, test::quad({-1, 0.3f, -1.7f}, {2.1f, 1.1f, 0}, {0, 0.9f, 2.3f}, lamp));
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const DirectLight light(rays, {});
    const HitLights hits(collect_lights(rays));
    DirectLight::Workspace w;
    RandomStream random(4);
    for (int i = 0; i < 500; ++i) {
        const float u = random.next();
        const glm::vec3 side(i % 2 == 0 ? 1.0f : -1.0f);
        const SurfacePoint p =
            surface_at(rays, 0, static_cast<std::uint32_t>(i % 2), u, (1.0f - u) * random.next(), side);
        const Bsdf bsdf = metal(0.3f);
        ASSERT_EQ(light.at(p, {&bsdf, p.geometric_normal}, mix64(static_cast<std::uint64_t>(i)), w).irradiance,
                  glm::vec3(0.0f));
        ASSERT_EQ(hits.sample(p, random).irradiance, glm::vec3(0.0f));
    }
}

TEST(GlossyDirectLight, ManySmallLampsAddUpToTheSameHighlight)
{
    // The same lamp as 80 x 80 x 2 triangles: the tree draws some of them.
    Scene scene = lamp_scene();
    Mesh& lamp = scene.meshes[1];
    lamp.positions.clear();
    lamp.triangles.clear();
    const int n = 80;
    const float step = 1.0f / n;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            test::merge(lamp,
                        test::quad({-0.5f + static_cast<float>(i) * step, 1.5f, -2.0f + static_cast<float>(j) * step},
                                   {step, 0, 0}, {0, 0, step}, lamp.material));
    const SurfacePoint point = floor_point(0.1f, 0.2f);
    const glm::vec3 outgoing = glm::normalize(glm::vec3(0.0f, 1.5f, 1.7f));
    for (const float alpha : {0.05f, 0.3f, 0.8f}) {
        const glm::dvec3 expected = by_area(point, metal(alpha), outgoing, 1000);
        const Estimate e = estimate(scene, point, metal(alpha), outgoing, 1000);
        EXPECT_NEAR(e.mean.g / expected.g, 1.0, 5.0 * e.deviation / std::sqrt(1000.0) + 2e-3) << alpha;
        EXPECT_LT(e.deviation, 0.15) << alpha;
    }
}

TEST(SkyPeaks, LightAsTheirIntegralSays)
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    test::add_mesh(scene, test::quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, grey));
    EnvironmentImage& image = scene.environment;
    image.width = 256;
    image.height = 128;
    image.radiance.assign(256 * 128, glm::vec3(0.0f));
    for (int y = 40; y < 44; ++y)
        for (int x = 100; x < 104; ++x)
            image.radiance[static_cast<std::size_t>(y * 256 + x)] = {2000.0f, 1000.0f, 500.0f};
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const DirectLight light(rays, {});
    DirectLight::Workspace w;
    const double theta = std::numbers::pi * 42.0 / 128.0;
    const double side = 4.0 * std::numbers::pi / 128.0;
    const double expected = 1000.0 * side * side * std::sin(theta) * std::cos(theta);
    const Lit lit = light.at(floor_point(0, 0), {}, 7, w);
    EXPECT_NEAR(static_cast<double>(lit.irradiance.g), expected, 0.02 * expected);
    EXPECT_NEAR(static_cast<double>(lit.irradiance.r), 2.0 * expected, 0.04 * expected);
    // Looked at in a mirror, the sun has its own radiance.
    const Bsdf mirror = metal(kLeastAlpha);
    const double phi = 2.0 * std::numbers::pi * (102.0 / 256.0 - 0.5);
    const glm::vec3 sun(std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi));
    const glm::vec3 outgoing(-sun.x, sun.y, -sun.z);
    const float albedo = test::specular_albedo(mirror, outgoing.y).g;
    EXPECT_NEAR(light.at(floor_point(0, 0), {&mirror, outgoing}, 7, w).glossy.g, 1000.0f * albedo, 20.0f);
}

/// A second look that goes on from the first brings the same light as one that begins anew, bit for bit, by fewer rays.
TEST(DirectLight, SecondLooksGoOnFromTheFirst)
{
    Scene scene = lamp_scene();
    for (int k = 0; k < 9; ++k) {  // more than what is kept of a first look
        const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f + static_cast<float>(k)));
        const float x = -4.0f + static_cast<float>(k);
        test::add_mesh(scene, test::quad({x, 2.0f, 1.0f}, {0.5f, 0, 0}, {0, 0, 0.5f}, lamp));
    }
    test::add_mesh(scene, test::quad({-10, 1.2f, -1.5f}, {0, 0, 20}, {10.2f, 0, 0}, 0));
    scene.lights = {test::point_light({0.3, 1.0, 0.3}, glm::vec3(2.0f))};
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const DirectLight light(rays, {});
    for (const float alpha : {0.05f, 0.5f}) {
        const Bsdf bsdf = metal(alpha);
        for (const float x : {-0.5f, 0.0f, 0.4f}) {
            const SurfacePoint point = floor_point(x, 0.2f);
            const DirectLight::Viewer viewer{&bsdf, glm::normalize(glm::vec3(0.3f, 0.7f, 0.6f))};
            DirectLight::Workspace anew, going_on;
            FirstLook look;
            light.at(point, viewer, 11, going_on, 0, &look);
            EXPECT_TRUE(look.is_over);
            const std::uint64_t first = going_on.rays;
            for (const std::uint64_t mixed : {std::uint64_t{0}, ~std::uint64_t{0}}) {
                const std::uint64_t before = anew.rays, before_going_on = going_on.rays;
                FirstLook again = look;
                const Lit expected = light.at(point, viewer, 11, anew, mixed);
                const Lit lit = light.at(point, viewer, 11, going_on, mixed, &again);
                EXPECT_EQ(lit.irradiance, expected.irradiance);
                EXPECT_EQ(lit.glossy, expected.glossy);
                EXPECT_LT(going_on.rays - before_going_on + first / 2, anew.rays - before);
            }
        }
    }
}

}  // namespace
}  // namespace rcs
