// Whole pictures with several bounces, against series, symmetry and the path tracer.

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "rcs/metrics.h"
#include "rcs/render.h"
#include "support/session.h"
#include "support/tracing.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

RenderResult render_first(const Scene& scene, int size, int bounces, int threads = 2)
{
    RenderOptions options;
    options.width = options.height = size;
    options.aa = 1;
    options.bounces = bounces;
    RenderResult result = test::render_first(scene, options, threads);
    EXPECT_EQ(result.stats.unserved_pixels, 0u);
    return result;
}

TEST(Bounces, OfAClosedEmissiveBoxSumTheGeometricSeries)
{
    for (const float albedo : {0.5f, 0.95f}) {
        const double rho = static_cast<double>(albedo);
        for (const int bounces : {2, 3, 8, 64}) {
            const LayeredImage image = render_first(test::emissive_box(albedo, 3.0f), 48, bounces).image;
            const double expected = 3.0 * (1.0 - std::pow(rho, bounces + 2)) / (1.0 - rho);
            EXPECT_NEAR(test::mean(image, "beauty"), expected, 0.01 * expected) << rho << ' ' << bounces;
        }
    }
}

/// A convex body sees nothing but the sky, whatever the number of bounces.
TEST(Bounces, LeaveAConvexBodyUnderAnOpenSkyAsItIs)
{
    for (const int bounces : {2, 64}) {
        const LayeredImage image = render_first(test::furnace(0.7f, 2.0f), 48, bounces).image;
        EXPECT_NEAR(test::mean(image, "indirect"), 0.7 * 2.0, 0.002 * 1.4) << bounces;
    }
}

/// Inside a closed sphere under its own central light every bounce adds the same everywhere.
TEST(Bounces, InALitSphereAreUniform)
{
    const double rho = 0.8;
    const LayeredImage image = render_first(test::lit_sphere(0.8f), 48, 8).image;
    const double expected = 0.25 * rho * (1.0 - std::pow(rho, 8)) / (1.0 - rho);
    const Image& irradiance = image.layers.at("irradiance");
    for (int i = 0; i < 48; ++i) {
        EXPECT_NEAR(static_cast<double>(irradiance.at(i, 7)[0]), expected, 0.02 * expected) << i;
        EXPECT_NEAR(static_cast<double>(irradiance.at(5, i)[1]), expected, 0.02 * expected) << i;
    }
}

Scene two_plates()
{
    Scene scene;
    const int white = test::add_material(scene, {0.9f, 0.6f, 0.3f});
    test::add_mesh(scene, test::quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, white));
    test::add_mesh(scene, test::quad({-1, 0.8f, -1}, {2, 0, 0}, {0, 0, 2}, white));
    scene.sky_radiance = {1.0f, 1.0f, 0.5f};
    scene.cameras = {look_at_camera("camera", {0.0, 0.5, 2.5}, {0.0, 0.3, 0.0}, 0.7)};
    return scene;
}

void expect_like_the_path_tracer(const Scene& scene, int size, int bounces, double most_bias, double most_mre)
{
    const LayeredImage image = render_first(scene, size, bounces).image;
    const LayeredImage reference = test::trace(scene, size, {.samples = 1024, .bounces = bounces, .stride = size / 20});
    const ErrorMetrics error = compare_images(image, reference, "indirect");
    EXPECT_NEAR(error.ratio_of_means, 1.0, most_bias) << bounces;
    EXPECT_LT(error.mean_relative_error, most_mre) << bounces;
}

TEST(Bounces, BetweenTwoPlatesAreThoseOfThePathTracer)
{
    // Irradiance is convex here: the records' tangents lie below it, by 2 % at this size without any bounce.
    expect_like_the_path_tracer(two_plates(), 240, 2, 0.025, 0.03);
    expect_like_the_path_tracer(two_plates(), 240, 8, 0.025, 0.03);
}

TEST(Bounces, InAFurnishedRoomAreThoseOfThePathTracer)
{
    expect_like_the_path_tracer(test::furnished_room(), 64, 2, 0.01, 0.04);
    expect_like_the_path_tracer(test::furnished_room(), 64, 8, 0.01, 0.04);
}

Scene scaled(Scene scene, double s)
{
    for (Mesh& mesh : scene.meshes)
        for (glm::vec3& p : mesh.positions) p *= static_cast<float>(s);
    for (PunctualLight& light : scene.lights) {
        light.position *= s;
        light.intensity *= static_cast<float>(s * s);
    }
    for (Camera& camera : scene.cameras)
        camera.world_from_view[3] = glm::dvec4(s * glm::dvec3(camera.world_from_view[3]), 1.0);
    return scene;
}

/// Over some seeds, which a rounding sets apart as well: what gathers learn from each other hangs on it.
std::array<double, 3> mean_indirect(const Scene& scene)
{
    constexpr int kSeeds = 8;
    std::array<double, 3> sum{};
    RenderOptions options;
    options.width = options.height = 48;
    options.aa = 1;
    options.bounces = 4;
    for (options.seed = 1; options.seed <= kSeeds; ++options.seed) {
        const LayeredImage image = test::render_first(scene, options).image;
        for (std::size_t c = 0; c < 3; ++c) sum[c] += test::mean(image, "indirect", static_cast<int>(c)) / kSeeds;
    }
    return sum;
}

TEST(Bounces, DoNotDependOnTheUnitOfLength)
{
    const Scene scene = test::furnished_room();
    const std::array<double, 3> expected = mean_indirect(scene);
    for (const double s : {1e-3, 1e3}) {
        const std::array<double, 3> found = mean_indirect(scaled(scene, s));
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1.0, 0.01) << s;
    }
}

TEST(Bounces, GiveTheSameBitsForAnyNumberOfThreads)
{
    const Scene scene = test::furnished_room();
    const RenderResult one = render_first(scene, 48, 3, 1), three = render_first(scene, 48, 3, 3);
    EXPECT_GT(one.stats.light_cache.cells, 100u);
    EXPECT_EQ(one.image.layers.at("beauty").pixels, three.image.layers.at("beauty").pixels);
}

TEST(Bounces, BeyondTheFirstCostNothingWhereThereAreNone)
{
    const RenderResult result = render_first(test::furnished_room(), 32, 1);
    EXPECT_EQ(result.stats.light_cache.rays, 0u);
    for (const auto& [stage, seconds] : result.stats.stage_seconds) EXPECT_NE(stage, "bounces");
}

TEST(Bounces, InAnEmptySceneShowTheSky)
{
    Scene scene;
    scene.sky_radiance = {0.5f, 1.0f, 2.0f};
    scene.cameras = {look_at_camera("camera", {0, 0, 3}, {0, 0, 0}, 0.8)};
    const LayeredImage image = render_first(scene, 16, 8).image;
    EXPECT_EQ(image.layers.at("beauty").at(8, 8)[2], 2.0f);
}

TEST(Bounces, OnALoneTriangleAreTheSkysOwnLight)
{
    Scene scene;
    Mesh mesh;
    mesh.positions = {{-1, 0, -1}, {0, 0, 1}, {1, 0, -1}};
    mesh.triangles = {{0, 1, 2}};
    mesh.material = test::add_material(scene, glm::vec3(0.5f), glm::vec3(0.0f), true);
    test::add_mesh(scene, mesh);
    scene.sky_radiance = glm::vec3(1.0f);
    scene.cameras = {look_at_camera("camera", {0, 3, 0.1}, {0, 0, 0}, 0.8)};
    const LayeredImage image = render_first(scene, 32, 8).image;
    EXPECT_NEAR(test::mean(image, "irradiance"), kPi, 0.01);
}

}  // namespace
}  // namespace rcs
