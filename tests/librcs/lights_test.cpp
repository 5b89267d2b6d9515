#include "lamps/lights.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "support/scenes.h"

namespace rcs {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

PunctualLight spot_light(float inner, float outer)
{
    PunctualLight light = test::point_light({0.0, 3.0, 0.0}, {1.0f, 2.0f, 4.0f});
    light.kind = LightKind::spot;
    light.direction = {0.0, -1.0, 0.0};
    light.inner_cone = inner;
    light.outer_cone = outer;
    return light;
}

TEST(SamplePunctual, PointLightFallsWithTheSquareOfDistance)
{
    const PunctualLight light = test::point_light({0.0, 3.0, 4.0}, {1.0f, 2.0f, 4.0f});
    const PunctualSample s = sample_punctual(light, {0, 0, 0});
    EXPECT_FLOAT_EQ(s.distance, 5.0f);
    EXPECT_FLOAT_EQ(s.irradiance.r, 1.0f / 25.0f);
    EXPECT_FLOAT_EQ(s.irradiance.b, 4.0f / 25.0f);
    EXPECT_FLOAT_EQ(s.to_light.y, 0.6f);
    EXPECT_FLOAT_EQ(s.to_light.z, 0.8f);
}

TEST(SamplePunctual, RangeFadesToZeroAsTheGltfExtensionSays)
{
    PunctualLight light = test::point_light({0.0, 0.0, 0.0}, glm::vec3(1.0f));
    light.range = 4.0f;
    EXPECT_FLOAT_EQ(sample_punctual(light, {2, 0, 0}).irradiance.r, (1.0f - 1.0f / 16.0f) / 4.0f);
    EXPECT_EQ(sample_punctual(light, {4, 0, 0}).irradiance.r, 0.0f);
    EXPECT_EQ(sample_punctual(light, {5, 0, 0}).irradiance.r, 0.0f);
}

TEST(SamplePunctual, SpotFadesBetweenItsCones)
{
    const PunctualLight light = spot_light(0.2f, 0.6f);
    const auto at_angle = [&](float angle) { return sample_punctual(light, {3 * std::tan(angle), 0, 0}); };
    const auto expected = [](float angle, float attenuation) {
        const float distance = 3 / std::cos(angle);
        return attenuation / (distance * distance);
    };
    EXPECT_NEAR(at_angle(0.0f).irradiance.r, expected(0.0f, 1.0f), 1e-6);
    EXPECT_NEAR(at_angle(0.19f).irradiance.r, expected(0.19f, 1.0f), 1e-6);
    const float edge = (std::cos(0.4f) - std::cos(0.6f)) / (std::cos(0.2f) - std::cos(0.6f));
    EXPECT_NEAR(at_angle(0.4f).irradiance.r, expected(0.4f, edge * edge), 1e-6);
    EXPECT_EQ(at_angle(0.61f).irradiance.r, 0.0f);
}

TEST(SamplePunctual, SpotWithoutSoftEdgeOrWithoutWidthStaysFinite)
{
    for (const float cone : {0.0f, 0.3f, 0.5f * kPi}) {
        const PunctualLight light = spot_light(cone, cone);
        const glm::vec3 points[] = {{0, 0, 0}, {0.1f, 0, 0}, {2, 0, 0}, {0, 5, 0}};
        for (const glm::vec3 p : points) {
            const glm::vec3 e = sample_punctual(light, p).irradiance;
            EXPECT_TRUE(std::isfinite(e.r) && e.r >= 0.0f) << cone;
        }
    }
}

TEST(SamplePunctual, DirectionalLightIsTheSameEverywhere)
{
    PunctualLight sun;
    sun.kind = LightKind::directional;
    sun.direction = {0.0, -0.6, 0.8};
    sun.intensity = glm::vec3(3.0f);
    const PunctualSample s = sample_punctual(sun, {1e5f, -7, 3});
    EXPECT_EQ(s.irradiance, glm::vec3(3.0f));
    EXPECT_EQ(s.to_light, glm::vec3(0.0f, 0.6f, -0.8f));
    EXPECT_EQ(s.distance, std::numeric_limits<float>::infinity());
}

TEST(SamplePunctual, StaysFiniteWhereTheLightTouchesThePoint)
{
    const PunctualLight light = test::point_light({1.0, 1.0, 1.0}, glm::vec3(1e9f));
    for (const float d : {0.0f, 1e-30f, 1e-6f}) {
        const PunctualSample s = sample_punctual(light, {1.0f + d, 1.0f, 1.0f});
        EXPECT_TRUE(std::isfinite(s.irradiance.r) && s.irradiance.r >= 0.0f);
        EXPECT_NEAR(glm::length(s.to_light), 1.0f, 1e-6);
    }
}

TEST(CollectLights, FindsTheTrianglesThatEmitWithTheirFrontNormals)
{
    Scene scene = test::square_lamp();
    scene.sky_radiance = {0.1f, 0.2f, 0.3f};
    scene.lights = {test::point_light({0.0, 0.5, 0.0}, glm::vec3(1.0f))};
    const ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const Lights lights = collect_lights(rays);
    EXPECT_EQ(lights.punctual.size(), 1u);
    EXPECT_EQ(lights.sky_radiance, scene.sky_radiance);
    ASSERT_EQ(lights.triangles.size(), 2u);
    for (const EmissiveTriangle& t : lights.triangles) {
        EXPECT_FLOAT_EQ(t.area, 2.0f);
        EXPECT_EQ(t.normal, glm::vec3(0.0f, -1.0f, 0.0f));
        EXPECT_EQ(t.radiance, glm::vec3(1.0f));
        EXPECT_FALSE(t.double_sided);
        EXPECT_FLOAT_EQ(t.corner[0].y, 1.0f);
    }
}

TEST(CollectLights, TurnsNormalsWithInstancesAlsoWhereTheyMirror)
{
    Scene scene;
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    test::add_mesh(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, lamp));
    // The same mesh moved, turned about x by 180 degrees, mirrored in x, and mirrored in z. A mirror image
    // of a lamp shines from the mirror image of its front.
    const auto diagonal = [](double x, double y, double z) {
        glm::dmat4 m(1.0);
        m[0][0] = x, m[1][1] = y, m[2][2] = z;
        m[3] = glm::dvec4(0.0, 0.0, 5.0, 1.0);
        return m;
    };
    const glm::dmat4 transforms[] = {diagonal(1, 1, 1), diagonal(1, -1, -1), diagonal(-1, 1, 1), diagonal(1, 1, -1)};
    const float front_z[] = {1.0f, -1.0f, 1.0f, -1.0f};
    for (int copies = 1; copies <= 2; ++copies) {  // a mesh used once is baked, used twice it is an instance
        for (int i = 0; i < 4; ++i) {
            Scene one = scene;
            one.instances.assign(static_cast<std::size_t>(copies), scene.instances[0]);
            for (Instance& instance : one.instances) instance.world_from_object = transforms[i];
            const ThreadPool pool(1);
            const RayScene rays = build_ray_scene(one, pool);
            const Lights lights = collect_lights(rays);
            ASSERT_EQ(lights.triangles.size(), static_cast<std::size_t>(2 * copies));
            for (const EmissiveTriangle& t : lights.triangles)
                EXPECT_FLOAT_EQ(t.normal.z, front_z[i]) << i << ' ' << copies;
        }
    }
}

TEST(CollectLights, LeavesOutTrianglesWithoutArea)
{
    Scene scene;
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f));
    Mesh mesh = test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, lamp);
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({2, 2, 2});
    test::add_mesh(scene, mesh);
    const ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    EXPECT_EQ(collect_lights(rays).triangles.size(), 2u);
}

/// Shadow rays from points of the scene's first mesh to points of its second one, a lamp.
struct Shots {
    int blocked = 0, all = 0;
};
Shots shoot(const Scene& scene)
{
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const Lights lights = collect_lights(rays);
    std::mt19937 random(21);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    Shots shots;
    for (int i = 0; i < 5000; ++i) {
        const float r = std::sqrt(unit(random)), u = r * unit(random);
        const SurfacePoint floor = surface_at(rays, 0, i % 2, u, r - u, {0.0f, -1.0f, 0.0f});
        const EmissiveTriangle& lamp = lights.triangles[static_cast<std::size_t>(i / 2 % 2)];
        // Kept off the lamp's edges, where a slanted ray passes beside a blocker.
        const float a = 0.05f + 0.4f * unit(random), b = 0.05f + 0.4f * unit(random);
        const glm::vec3 q =
            lamp.corner[0] + a * (lamp.corner[1] - lamp.corner[0]) + b * (lamp.corner[2] - lamp.corner[0]);
        shots.blocked += occluded(rays, shadow_ray_to(lamp, floor, q - floor.position)) ? 1 : 0;
        ++shots.all;
    }
    return shots;
}

/// A floor at y = 1, and what lies above it.
Scene above_floor(float scale, const Mesh& lamp)
{
    Scene scene;
    const int grey = test::add_material(scene, glm::vec3(0.5f));
    test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f), true);
    test::add_mesh(scene, test::quad(glm::vec3(2, 1, -4), glm::vec3(0, 0, 8), glm::vec3(8, 0, 0), grey));
    test::add_mesh(scene, lamp);
    for (Mesh& mesh : scene.meshes)
        for (glm::vec3& p : mesh.positions) p *= scale;
    return scene;
}

TEST(ShadowRayTo, EndsBeforeALampHoweverItIsGrazedButAfterABlockerBeforeIt)
{
    for (const float scale : {1e-3f, 1e-1f, 1.0f, 40.0f, 1e3f, 1e5f}) {
        // One that leans, so that its points are rounded, and one that floats 2 mm above a floor 8 m wide.
        const Mesh leaning = test::quad(glm::vec3(3, 4, -1), glm::vec3(2, 0.3f, 0), glm::vec3(0, 0.1f, 2), 1);
        const Mesh close = test::quad(glm::vec3(3, 1.002f, -1), glm::vec3(2, 0, 0), glm::vec3(0, 0, 2), 1);
        for (const Mesh* lamp : {&leaning, &close}) {
            Scene scene = above_floor(scale, *lamp);
            EXPECT_EQ(shoot(scene).blocked, 0) << scale;
            Mesh blocker = lamp == &close ? scene.meshes[0] : scene.meshes[1];
            blocker.material = 0;
            for (glm::vec3& p : blocker.positions) p.y += (p.y < 2.0f * scale ? 0.001f : -0.01f) * scale;
            test::add_mesh(scene, blocker);
            const Shots shots = shoot(scene);
            EXPECT_EQ(shots.blocked, shots.all) << scale;
        }
    }
}

}  // namespace
}  // namespace rcs
