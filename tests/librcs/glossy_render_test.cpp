#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "gbuffer/shading.h"
#include "rcs/ray_scene.h"
#include "rcs/render.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

RenderResult render_first(const Scene& scene, int size, int threads = 2)
{
    RenderOptions options;
    options.width = options.height = size;
    options.aa = 1;
    return test::render_first(scene, options, threads);
}

glm::vec3 at(const RenderResult& result, const char* layer, int x, int y)
{
    const float* p = result.image.layers.at(layer).at(x, y);
    return {p[0], p[1], p[2]};
}

// A convex white body under a white sky cannot be told from the sky, whatever its gloss: what it
// absorbs or makes up shows as a difference. Every technique has its turn: roughness 0 to 0.5 is ray traced, the
// rest lit by records.
TEST(GlossyRender, AWhiteFurnaceHidesEveryRoughness)
{
    for (const float metallic : {0.0f, 1.0f}) {
        for (int step = 0; step <= 10; ++step) {
            Scene scene;
            scene.sky_radiance = glm::vec3(1.0f);
            const int material =
                test::add_material(scene, test::glossy(metallic, 0.1f * static_cast<float>(step), glm::vec3(1.0f)));
            test::add_mesh(scene, test::icosphere({0, 0, 0}, 1.0f, 4, material));
            scene.cameras.push_back(look_at_camera("front", {0, 0, 4}, {0, 0, 0}, 0.6));
            const RenderResult result = render_first(scene, 48);
            double mean = 0.0, worst = 0.0;
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 48; ++x) {
                    const double value = static_cast<double>(at(result, "beauty", x, y).g);
                    mean += value / (48.0 * 48.0);
                    // Facets at the silhouette reflect directions that their smooth normals do not.
                    if ((x - 23.5) * (x - 23.5) + (y - 23.5) * (y - 23.5) < 15.0 * 15.0)
                        worst = std::max(worst, std::abs(value - 1.0));
                }
            const std::string what =
                "metallic " + std::to_string(metallic) + ", roughness " + std::to_string(0.1 * step);
            EXPECT_NEAR(mean, 1.0, 0.01) << what;
            EXPECT_LT(worst, 0.02) << what;
        }
    }
}

/// A mirror on the floor before a wall that the sun lights.
Scene mirror_before_a_wall(float roughness)
{
    Scene scene;
    const int mirror = test::add_material(scene, test::glossy(1.0f, roughness, glm::vec3(0.8f, 0.6f, 0.4f)));
    const int wall = test::add_material(scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
    test::add_mesh(scene, test::quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, mirror));
    test::add_mesh(scene, test::quad({-50, -1, -5}, {100, 0, 0}, {0, 50, 0}, wall));
    PunctualLight sun;
    sun.kind = LightKind::directional;
    sun.direction = {0.0, 0.0, -1.0};
    sun.intensity = glm::vec3(kPi);
    scene.lights.push_back(sun);
    scene.cameras.push_back(look_at_camera("above", {0.0, 2.0, 4.0}, {0.0, 0.0, 0.0}, 0.5));
    return scene;
}

TEST(GlossyRender, AMirrorShowsWhatItReflects)
{
    const RenderResult result = render_first(mirror_before_a_wall(0.0f), 32);
    for (int y = 12; y < 32; ++y) {
        // The wall has radiance 0.5 everywhere that the mirror shows of it; Schlick's Fresnel adds a little.
        const glm::vec3 seen = at(result, "indirect", 16, y);
        EXPECT_NEAR(seen.r, 0.5f * 0.8f, 0.02f) << y;
        EXPECT_NEAR(seen.g, 0.5f * 0.6f, 0.03f) << y;
        EXPECT_GE(seen.b, 0.5f * 0.4f - 1e-3f) << y;
        EXPECT_LT(seen.b, 0.5f * 0.4f + 0.05f) << y;
    }
}

TEST(GlossyRender, GivesTheSameBitsForAnyNumberOfThreads)
{
    for (const float roughness : {0.2f, 0.9f}) {
        const Scene scene = mirror_before_a_wall(roughness);
        const RenderResult one = render_first(scene, 70, 1), three = render_first(scene, 70, 3);
        for (const auto& [name, layer] : one.image.layers)
            EXPECT_TRUE(layer.pixels == three.image.layers.at(name).pixels) << name << " at roughness " << roughness;
    }
}

TEST(GlossyRender, OfALambertianSceneShootsNoLobeRaysAndKeepsNoRadiance)
{
    const RenderResult result = render_first(test::furnished_room(), 48);
    EXPECT_EQ(result.stats.traced.rays, 0u);
    ASSERT_FALSE(result.records.empty());
    for (const Record& record : result.records) EXPECT_TRUE(record.radiance.empty());
}

/// A pane between the camera and a wall that glows with radiance 2.
Scene pane_before_a_glow(const Material& pane)
{
    Scene scene;
    const int in_front = test::add_material(scene, pane);
    const int glow = test::add_material(scene, glm::vec3(0.0f), glm::vec3(2.0f), true);
    test::add_mesh(scene, test::quad({-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, in_front));
    test::add_mesh(scene, test::quad({-9, -9, -3}, {18, 0, 0}, {0, 18, 0}, glow));
    scene.cameras.push_back(look_at_camera("front", {0, 0, 3}, {0, 0, 0}, 0.7));
    return scene;
}

TEST(GlossyRender, BlendsWhatLiesBehind)
{
    Material veil;
    veil.base_color = {1.0f, 0.5f, 0.0f};
    veil.unlit = true;
    veil.double_sided = true;
    veil.alpha = 0.25f;
    veil.alpha_mode = AlphaMode::blend;
    const RenderResult result = render_first(pane_before_a_glow(veil), 16);
    const glm::vec3 seen = at(result, "beauty", 8, 8);
    EXPECT_NEAR(seen.r, 0.25f * 1.0f + 0.75f * 2.0f, 1e-4f);
    EXPECT_NEAR(seen.g, 0.25f * 0.5f + 0.75f * 2.0f, 1e-4f);
    EXPECT_NEAR(seen.b, 0.75f * 2.0f, 1e-4f);
    EXPECT_NEAR(result.image.layers.at("beauty").at(8, 8)[3], 1.0f, 1e-4f);
}

TEST(GlossyRender, SeesThroughThinGlass)
{
    Material glass = test::glossy(0.0f, 0.0f, {0.9f, 0.5f, 0.2f});
    glass.transmission = 1.0f;
    const RenderResult result = render_first(pane_before_a_glow(glass), 17);
    // At normal incidence 4 % is reflected, of a black surrounding; the rest takes the pane's colour.
    const glm::vec3 seen = at(result, "beauty", 8, 8);
    EXPECT_NEAR(seen.r, 2.0f * 0.96f * 0.9f, 0.02f);
    EXPECT_NEAR(seen.g, 2.0f * 0.96f * 0.5f, 0.02f);
    EXPECT_NEAR(seen.b, 2.0f * 0.96f * 0.2f, 0.02f);
}

TEST(GlossyRender, AMaskShowsOnlyWhatItCovers)
{
    Material mask;
    mask.base_color = glm::vec3(0.3f);
    mask.unlit = true;
    mask.double_sided = true;
    mask.alpha_mode = AlphaMode::mask;
    mask.alpha = 0.4f;
    EXPECT_EQ(at(render_first(pane_before_a_glow(mask), 16), "beauty", 8, 8), glm::vec3(2.0f));
    mask.alpha = 0.6f;
    EXPECT_EQ(at(render_first(pane_before_a_glow(mask), 16), "beauty", 8, 8), glm::vec3(0.3f));
}

}  // namespace
}  // namespace rcs
