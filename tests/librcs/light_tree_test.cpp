#include "lamps/light_tree.h"

#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include <gtest/gtest.h>

#include "direct/direct_point.h"
#include "hit_light/hit_light.h"
#include "lamps/polygon.h"
#include "scene/texture.h"
#include "support/scenes.h"
#include "util/color.h"

namespace rcs {
namespace {

/// A hall 30 m long whose walls and ceiling are set with many little lamps of unequal power, each two triangles.
Scene hall_of_lamps(int lamps)
{
    Scene scene;
    const int floor = test::add_material(scene, glm::vec3(0.6f));
    test::add_mesh(scene, test::quad({-15, 0, -5}, {0, 0, 10}, {30, 0, 0}, floor));
    RandomStream random(11);
    Mesh meshes[4];
    for (int m = 0; m < 4; ++m)
        meshes[m].material = test::add_material(
            scene, glm::vec3(0.0f), glm::vec3(m + 1.0f, 2.0f, 4.0f - static_cast<float>(m)) * (m == 3 ? 20.0f : 1.0f));
    for (int i = 0; i < lamps; ++i) {
        const float u = 30.0f * random.next() - 15.0f, v = random.next(), size = 0.01f + 0.02f * random.next();
        const int wall = static_cast<int>(3.0f * random.next());
        const Mesh lamp = wall == 0   ? test::quad({u, 4.0f, 10.0f * v - 5.0f}, {size, 0, 0}, {0, 0, size}, 0)
                          : wall == 1 ? test::quad({u, 4.0f * v, -5.0f}, {size, 0, 0}, {0, size, 0}, 0)
                                      : test::quad({u, 4.0f * v, 5.0f}, {0, size, 0}, {size, 0, 0}, 0);
        test::merge(meshes[i % 50 == 0 ? 3 : i % 3], lamp);
    }
    for (Mesh& mesh : meshes) test::add_mesh(scene, mesh);
    return scene;
}

SurfacePoint at(glm::vec3 position, glm::vec3 normal)
{
    SurfacePoint p{};
    p.position = position;
    p.position_error = 1e-5f;
    p.geometric_normal = p.shading_normal = normal;
    return p;
}

glm::dvec3 brute_force(const std::vector<EmissiveTriangle>& triangles, const SurfacePoint& p)
{
    glm::dvec3 sum(0.0);
    for (const EmissiveTriangle& t : triangles) {
        if (!t.double_sided && glm::dot(t.normal, t.corner[0] - p.position) >= 0.0f) continue;
        const glm::vec3 corners[3] = {t.corner[0] - p.position, t.corner[1] - p.position, t.corner[2] - p.position};
        sum += glm::dvec3(t.radiance) * static_cast<double>(polygon_irradiance_factor(corners, 3, p.shading_normal));
    }
    return sum;
}

std::vector<SurfacePoint> places()
{
    std::vector<SurfacePoint> points;
    for (int i = 0; i < 6; ++i)
        points.push_back(at({-12.0f + 5.0f * static_cast<float>(i), 0.0f, -3.0f + static_cast<float>(i)}, {0, 1, 0}));
    points.push_back(at({0.0f, 3.95f, 0.0f}, glm::normalize(glm::vec3(1, 1, 0))));
    points.push_back(at({3.0f, 2.0f, -4.9f}, {0, 0, -1}));
    return points;
}

class LightTreeTest : public ::testing::Test {
protected:
    ThreadPool pool{2};
    Scene scene = hall_of_lamps(50000);
    RayScene rays = build_ray_scene(scene, pool);
    Lights lights = collect_lights(rays);
};

TEST_F(LightTreeTest, EveryPartOfALampIsDrawnWithItsChance)
{
    ASSERT_EQ(lights.triangles.size(), 100000u);
    for (const SurfacePoint& p : places()) {
        const glm::dvec3 expected = brute_force(lights.triangles, p);
        for (const std::size_t room : {std::size_t{1}, std::size_t{8}, std::size_t{64}}) {
            std::vector<LampCandidate> candidates(room);
            RandomStream random(room);
            glm::dvec3 mean(0.0);
            double square = 0.0;
            const int n = room == 1 ? 20000 : 2000;
            for (int i = 0; i < n; ++i) {
                const std::size_t count = lights.tree->draw(p.position, p.shading_normal, random.next(), candidates);
                ASSERT_LE(count, room);
                glm::dvec3 sum(0.0);
                for (std::size_t c = 0; c < count; ++c)
                    sum += static_cast<double>(candidates[c].multiplicity) *
                           brute_force({lights.triangles[candidates[c].lamp]}, p);
                mean += sum / static_cast<double>(n);
                square += sum.g * sum.g / n;
            }
            const double error = std::sqrt(std::max(0.0, square - mean.g * mean.g) / n);
            EXPECT_NEAR(mean.g, expected.g, 5.0 * error + 1e-4 * expected.g) << room;
            if (room == 64) {
                // Of a single draw, before any shadow ray.
                EXPECT_LT(error * std::sqrt(static_cast<double>(n)), 0.15 * expected.g + 1e-9);
            }
        }
    }
}

TEST_F(LightTreeTest, EstimatesAreZeroOnlyWhereNothingArrives)
{
    for (const SurfacePoint& p : places()) {
        for (std::uint32_t t = 0; t < lights.triangles.size(); t += 7) {
            const bool sends = brute_force({lights.triangles[t]}, p).g > 0.0;
            if (sends) {
                ASSERT_GT(lights.tree->estimate(t, p.position, p.shading_normal), 0.0f) << t;
            }
        }
    }
}

TEST_F(LightTreeTest, RaysThatMeetALampMayMeetOne)
{
    RandomStream random(5);
    for (int i = 0; i < 2000; ++i) {
        const EmissiveTriangle& t = lights.triangles[static_cast<std::size_t>(random.next() * 99999.0f)];
        const glm::vec3 origin(20.0f * random.next() - 10.0f, 4.0f * random.next(), 8.0f * random.next() - 4.0f);
        ASSERT_TRUE(
            lights.tree->may_meet(origin, glm::normalize((t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f - origin)));
    }
    EXPECT_FALSE(lights.tree->may_meet({0, 50, 0}, {0, 1, 0}));
}

/// What pixels get, and gather hits: unbiased, and fast enough.
TEST_F(LightTreeTest, DirectLightOfAHundredThousandTrianglesConverges)
{
    const DirectLight light(rays, {});
    const HitLights hits(lights);
    DirectLight::Workspace w;
    for (const SurfacePoint& p : places()) {
        if (p.position.y > 0.0f) continue;  // on the floor nothing blocks the lamps
        const glm::dvec3 expected = brute_force(lights.triangles, p);
        double mean = 0.0, square = 0.0, hit_mean = 0.0, hit_square = 0.0;
        const int n = 500, hit_n = 20000;
        for (int i = 0; i < n; ++i) {
            const double e = static_cast<double>(light.at(p, {}, mix64(static_cast<std::uint64_t>(i)), w).irradiance.g);
            mean += e / n;
            square += e * e / n;
        }
        RandomStream random(3);
        for (int i = 0; i < hit_n; ++i) {
            const double e = static_cast<double>(hits.sample(p, random).irradiance.g);
            hit_mean += e / hit_n;
            hit_square += e * e / hit_n;
        }
        const double deviation = std::sqrt(std::max(0.0, square - mean * mean));
        const double hit_deviation = std::sqrt(std::max(0.0, hit_square - hit_mean * hit_mean));
        EXPECT_NEAR(mean, expected.g, 5.0 * deviation / std::sqrt(static_cast<double>(n)));
        EXPECT_LT(deviation, 0.12 * expected.g);
        EXPECT_NEAR(hit_mean, expected.g, 5.0 * hit_deviation / std::sqrt(static_cast<double>(hit_n)));
        EXPECT_LT(hit_deviation, 1.0 * expected.g);
        RecordProperty("deviation", std::to_string(deviation / expected.g));
        std::printf("pixel: %.3f of the mean, hit: %.3f\n", deviation / expected.g, hit_deviation / expected.g);
    }
    // Processor time: the machine may be busy with other things.
    const SurfacePoint p = places()[2];
    const std::clock_t start = std::clock();
    for (int i = 0; i < 200; ++i) light.at(p, {}, static_cast<std::uint64_t>(i), w);
    const std::clock_t middle = std::clock();
    RandomStream random(3);
    for (int i = 0; i < 20000; ++i) hits.sample(p, random);
    const std::clock_t end = std::clock();
    std::printf("%.1f us a pixel, %.2f us a hit\n", static_cast<double>(middle - start) / 200,
                static_cast<double>(end - middle) / 20000);
}

/// A lamp of 2 x 2 m at height 1 whose emission texture is bright on one half and dark on the other.
Scene half_lit_lamp()
{
    Scene scene;
    const int floor = test::add_material(scene, glm::vec3(0.6f));
    test::add_mesh(scene, test::quad({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, floor));
    std::vector<glm::vec3> texels(64 * 64, glm::vec3(0.0f));
    for (std::size_t i = 0; i < texels.size(); ++i)
        if (i % 64 < 32) texels[i] = {1.0f, 0.5f, 0.25f};
    scene.textures.push_back(make_texture("halves", 64, 64, texels));
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(6.0f));
    scene.materials[static_cast<std::size_t>(lamp)].emission_texture.texture = 0;
    scene.materials[static_cast<std::size_t>(lamp)].emission_texture.wrap_u = Wrap::clamp_to_edge;
    Mesh mesh = test::quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, lamp);
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    test::add_mesh(scene, mesh);
    return scene;
}

TEST(TexturedEmission, LightsByWhatTheTextureShowsWhere)
{
    const Scene scene = half_lit_lamp();
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const Lights lights = collect_lights(rays);
    ASSERT_EQ(lights.triangles.size(), 2u);
    const glm::vec3 mean = (lights.triangles[0].radiance + lights.triangles[1].radiance) * 0.5f;
    EXPECT_NEAR(mean.r, 3.0f, 0.05f);
    EXPECT_NEAR(mean.b, 0.75f, 0.02f);
    EXPECT_NEAR(radiance_at(rays, lights.triangles[0], {-0.5f, 1.0f, -0.7f}).r, 6.0f, 1e-3f);
    EXPECT_NEAR(radiance_at(rays, lights.triangles[0], {0.9f, 1.0f, -0.95f}).r, 0.0f, 1e-3f);
    const DirectLight light(rays, {});
    const HitLights hits(lights);
    DirectLight::Workspace w;
    RandomStream random(8);
    for (const glm::vec2 at_xz : {glm::vec2(-1.5f, 0.2f), glm::vec2(0.0f, 0.0f), glm::vec2(1.8f, 0.5f)}) {
        const SurfacePoint p = at({at_xz.x, 0, at_xz.y}, {0, 1, 0});
        const double x = static_cast<double>(at_xz.x), z = static_cast<double>(at_xz.y);
        const double expected = 6.0 * test::rectangle_irradiance(-1.0 - x, -x, -1.0 - z, 1.0 - z, 1.0);
        double pixel = 0.0, hit = 0.0;
        for (int i = 0; i < 400; ++i)
            pixel += static_cast<double>(light.at(p, {}, mix64(static_cast<std::uint64_t>(i)), w).irradiance.r) / 400;
        for (int i = 0; i < 40000; ++i) hit += static_cast<double>(hits.sample(p, random).irradiance.r) / 40000;
        EXPECT_NEAR(pixel, expected, 0.01 * expected);
        EXPECT_NEAR(hit, expected, 0.03 * expected);
    }
}

}  // namespace
}  // namespace rcs
