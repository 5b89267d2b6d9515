// Narrow lobes seen in narrow lobes: mirrors in mirrors.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "rcs/render.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

RenderResult render_first(const Scene& scene, int size, int bounces, int threads = 2, int lobe_rays = 16)
{
    RenderOptions options;
    options.width = options.height = size;
    options.aa = 1;
    options.bounces = bounces;
    options.lobe_rays = lobe_rays;
    return test::render_first(scene, options, threads);
}

glm::vec3 at(const LayeredImage& image, int x, int y)
{
    const float* p = image.layers.at("beauty").at(x, y);
    return {p[0], p[1], p[2]};
}

glm::vec3 mean(const LayeredImage& image)
{
    const Image& beauty = image.layers.at("beauty");
    glm::dvec3 sum(0.0);
    for (int y = 0; y < beauty.height; ++y)
        for (int x = 0; x < beauty.width; ++x) sum += glm::dvec3(at(image, x, y));
    return glm::vec3(sum / static_cast<double>(beauty.width * beauty.height));
}

int add_surface(Scene& scene, float metallic, float roughness, glm::vec3 color)
{
    return test::add_material(scene, test::glossy(metallic, roughness, color));
}

/// Two plates face each other, and a beam from the camera goes zigzag between them at 45 degrees, meets them so many
/// times, and leaves to the sky of radiance 1, or if that is black to a lamp of radiance 1.
Scene corridor(int (*add_plate)(Scene&), int reflections, bool lamp)
{
    Scene scene;
    const int material = add_plate(scene);
    const float end = static_cast<float>(reflections);
    test::add_mesh(scene, test::quad({0, 0, 0.5f}, {end, 0, 0}, {0, 0, -1}, material));
    test::add_mesh(scene, test::quad({0, 1, -0.5f}, {end, 0, 0}, {0, 0, 1}, material));
    if (lamp) {
        const int glow = test::add_material(scene, glm::vec3(0.0f), glm::vec3(1.0f), true);
        test::add_mesh(scene, test::quad({end + 2, -9, 9}, {0, 0, -18}, {0, 18, 0}, glow));
    } else {
        scene.sky_radiance = glm::vec3(1.0f);
    }
    scene.cameras.push_back(look_at_camera("along", {0.0, 0.5, 0.0}, {0.5, 0.0, 0.0}, 0.08));
    return scene;
}

int mirror(Scene& scene) { return add_surface(scene, 1.0f, 0.0f, {0.9f, 0.7f, 0.5f}); }
int black_lacquer(Scene& scene)
{
    const int index = add_surface(scene, 0.0f, 1.0f, glm::vec3(0.0f));
    scene.materials.back().specular = 0.0f;
    scene.materials.back().clearcoat = 1.0f;
    return index;
}
int black_plastic(Scene& scene) { return add_surface(scene, 0.0f, 0.0f, glm::vec3(0.0f)); }

glm::vec3 schlick(glm::vec3 f0, float cosine) { return f0 + (1.0f - f0) * std::pow(1.0f - cosine, 5.0f); }

TEST(LobePaths, FacingMirrorsGiveTheProductOfTheirReflectances)
{
    const glm::vec3 r = schlick({0.9f, 0.7f, 0.5f}, std::sqrt(0.5f));
    for (const bool lamp : {false, true}) {
        for (int bounces = 1; bounces <= 3; ++bounces) {
            const std::string what = "bounces " + std::to_string(bounces) + (lamp ? ", lamp" : ", sky");
            const int most = bounces + 1;  // mirrors on a path, the visible one with them
            const glm::vec3 seen = mean(render_first(corridor(mirror, most, lamp), 8, bounces).image);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(seen[c], std::pow(r[c], static_cast<float>(most)), 0.02f * seen[c])
                    << what << " channel " << c;
            // One mirror more than the path may meet: nothing but what lobes that are not quite mirrors let out.
            const glm::vec3 cut = mean(render_first(corridor(mirror, most + 1, lamp), 8, bounces).image);
            EXPECT_LT(cut.r, 0.01f) << what;
        }
    }
}

TEST(LobePaths, CoatsAndDielectricsReflectEachOtherToo)
{
    const float r = schlick(glm::vec3(0.04f), std::sqrt(0.5f)).r;
    for (const auto surface : {black_lacquer, black_plastic})
        EXPECT_NEAR(mean(render_first(corridor(surface, 2, false), 16, 1).image).g, r * r, 0.1f * r * r);
}

/// White metal between white metal, under a white sky: whatever the lobes, nobody can tell it from the sky.
TEST(LobePaths, AWhiteFurnaceOfMirrorsNeitherGainsNorLoses)
{
    for (const float roughness : {0.0f, 0.2f, 0.35f, 0.45f, 0.6f}) {
        Scene scene;
        scene.sky_radiance = glm::vec3(1.0f);
        const int white = add_surface(scene, 1.0f, roughness, glm::vec3(1.0f));
        const int smooth = add_surface(scene, 1.0f, 0.1f, glm::vec3(1.0f));
        test::add_mesh(scene, test::icosphere({-1.05f, 0, 0}, 1.0f, 4, white));
        test::add_mesh(scene, test::icosphere({1.05f, 0, 0}, 1.0f, 4, smooth));
        scene.cameras.push_back(look_at_camera("front", {0, 0, 6}, {0, 0, 0}, 0.5));
        const glm::vec3 seen = mean(render_first(scene, 40, 8).image);
        EXPECT_NEAR(seen.g, 1.0f, 0.01f) << roughness;
    }
}

/// Two spheres on a floor below a small lamp; each shows the other.
Scene two_spheres(float roughness)
{
    Scene scene;
    const int metal = add_surface(scene, 1.0f, roughness, {0.9f, 0.8f, 0.6f});
    const int mirrors = add_surface(scene, 1.0f, 0.0f, {0.9f, 0.9f, 0.9f});
    const int floor = test::add_material(scene, glm::vec3(0.5f, 0.4f, 0.3f), glm::vec3(0.0f), true);
    const int glow = test::add_material(scene, glm::vec3(0.0f), glm::vec3(200.0f), true);
    test::add_mesh(scene, test::icosphere({-1.1f, 1, 0}, 1.0f, 4, metal));
    test::add_mesh(scene, test::icosphere({1.1f, 1, 0}, 1.0f, 4, mirrors));
    test::add_mesh(scene, test::quad({-8, 0, 8}, {16, 0, 0}, {0, 0, -16}, floor));
    test::add_mesh(scene, test::quad({-0.15f, 4, 2.5f}, {0, 0, 0.3f}, {0.3f, 0, 0}, glow));
    scene.cameras.push_back(look_at_camera("front", {0, 1.5, 6}, {0, 0.9, 0}, 0.5));
    return scene;
}

TEST(LobePaths, AMirrorInAMirrorUnderASmallLampAgreesWithTheReference)
{
    constexpr int kSize = 24;
    for (const float roughness : {0.0f, 0.3f}) {
        for (const int bounces : {1, 2}) {
            const Scene scene = two_spheres(roughness);
            const RenderResult ours = render_first(scene, kSize, bounces);
            ThreadPool pool(2);
            const RayScene rays = build_ray_scene(scene, pool);
            const LayeredImage reference = render_reference(rays, {scene.cameras[0], kSize, kSize, {0.5, 0.5}},
                                                            {.samples = 1024, .bounces = bounces}, pool);
            double difference = 0.0, sum = 0.0;
            int compared = 0;
            for (int y = 0; y < kSize; ++y)
                for (int x = 0; x < kSize; ++x) {
                    const double r = static_cast<double>(at(reference, x, y).g);
                    // Some paths find the lamp in a mirror that the floor sees: single bright ones, nothing about ours.
                    if (static_cast<double>(reference.layers.at("standard_error").at(x, y)[1]) > 0.05 * r) continue;
                    difference += std::abs(static_cast<double>(at(ours.image, x, y).g) - r);
                    sum += r;
                    ++compared;
                }
            EXPECT_GT(compared, kSize * kSize / 3);
            EXPECT_LT(difference, (bounces == 1 ? 0.06 : 0.1) * sum)
                << "roughness " << roughness << ", bounces " << bounces;
        }
    }
}

/// A pane before a floor and a lamp, both behind it, and a small sun that shines through.
TEST(LobePaths, AFrostedPaneBlursAsInTheReference)
{
    constexpr int kSize = 16;
    for (const bool has_sky : {false, true}) {
        Scene scene;
        const int pane = add_surface(scene, 0.0f, 0.5f, {0.9f, 0.6f, 0.5f});
        scene.materials.back().transmission = 1.0f;
        const int wall = test::add_material(scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
        const int glow = test::add_material(scene, glm::vec3(0.0f), glm::vec3(6.0f), true);
        test::add_mesh(scene, test::quad({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, pane));
        test::add_mesh(scene, test::quad({-2, -1, 0}, {4, 0, 0}, {0, 0, -4}, wall));
        test::add_mesh(scene, test::quad({0.3f, -0.5f, -2}, {1.5f, 0, 0}, {0, 1.5f, 0}, glow));
        if (has_sky) scene.sky_radiance = glm::vec3(0.3f);
        PunctualLight lamp;
        lamp.position = {-1.0, 1.0, -1.5};
        lamp.intensity = glm::vec3(3.0f);
        scene.lights.push_back(lamp);
        scene.cameras.push_back(look_at_camera("front", {0, 0, 4}, {0, 0, 0}, 0.8));
        const RenderResult ours = render_first(scene, kSize, 1, 2, 256);
        ThreadPool pool(2);
        const RayScene rays = build_ray_scene(scene, pool);
        for (const int aa : {1, 4}) {
            const LayeredImage reference = render_reference(rays, {scene.cameras[0], kSize, kSize, {0.5, 0.5}},
                                                            {.samples = 1024, .bounces = 1, .aa = aa}, pool);
            const glm::vec3 a = mean(ours.image), b = mean(reference);
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.03f * b[c]) << "aa " << aa << " channel " << c;
        }
        // What is behind is blurred: the lamp's edge shows on neither side as it is.
        const glm::vec3 lamp_here = at(ours.image, 11, 8), beside = at(ours.image, 7, 8);
        EXPECT_GT(beside.r, 0.1f * lamp_here.r);
    }
}

TEST(LobePaths, GiveTheSameBitsForAnyNumberOfThreads)
{
    const Scene scene = two_spheres(0.3f);
    const RenderResult one = render_first(scene, 40, 4, 1), three = render_first(scene, 40, 4, 3);
    EXPECT_EQ(one.stats.traced.rays, three.stats.traced.rays);
    for (const auto& [name, layer] : one.image.layers)
        EXPECT_TRUE(layer.pixels == three.image.layers.at(name).pixels) << name;
}

TEST(LobePaths, WithoutABounceAMirrorShowsTheSkyAlone)
{
    Scene scene = corridor(mirror, 1, false);
    EXPECT_NEAR(mean(render_first(scene, 8, 0).image).g, schlick(glm::vec3(0.7f), std::sqrt(0.5f)).g, 0.01f);
    EXPECT_LT(mean(render_first(corridor(mirror, 2, false), 8, 0).image).g, 0.01f);
}

}  // namespace
}  // namespace rcs
