// Scenes whose light is known by formula, rendered with records and splats. Default accuracy unless a
// test says otherwise; tolerances are those of the stability catalogue (architecture, "hard cases").
#include "rcs/render.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "rcs/gl_context.h"
#include "rcs/ray_scene.h"
#include "support/scenes.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

class AnalyticRender : public testing::TestWithParam<SplatMethod> {
protected:
    LayeredImage render_scene(const Scene& scene, int size, int bounces, int aa = 1)
    {
        ThreadPool pool(2);
        const RayScene rays = build_ray_scene(scene, pool);
        RenderOptions options;
        options.width = size;
        options.height = size;
        options.bounces = bounces;
        options.aa = aa;
        options.splat = GetParam();
        RenderResult result = render(gl(), rays, scene.cameras[0], options, pool);
        EXPECT_EQ(result.stats.unserved_pixels, 0u);
        expect_sane(result.image);
        return std::move(result.image);
    }

private:
    static GlContext& gl()
    {
        static GlContext context;
        return context;
    }

    static void expect_sane(const LayeredImage& image)
    {
        for (const auto& [name, layer] : image.layers) {
            for (const float value : layer.pixels) {
                ASSERT_FALSE(std::isnan(value)) << name;
                ASSERT_TRUE(name == "depth" || std::isfinite(value)) << name;
                ASSERT_TRUE(name == "normal" || value >= 0.0f) << name << ' ' << value;
            }
        }
    }
};

/// Least and greatest value of one channel over the pixels that see something.
struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    double mean = 0.0;
};
Range range_of(const LayeredImage& image, const std::string& layer)
{
    const Image& values = image.layers.at(layer);
    const Image& beauty = image.layers.at("beauty");
    Range range;
    int count = 0;
    for (int y = 0; y < values.height; ++y) {
        for (int x = 0; x < values.width; ++x) {
            if (beauty.at(x, y)[3] < 1.0f) continue;
            const double value = static_cast<double>(values.at(x, y)[0]);
            range.low = std::min(range.low, value);
            range.high = std::max(range.high, value);
            range.mean += value;
            ++count;
        }
    }
    range.mean /= count;
    return range;
}

void expect_uniform(const LayeredImage& image, const std::string& layer, double expected, double tolerance)
{
    const Range range = range_of(image, layer);
    EXPECT_NEAR(range.low, expected, tolerance * expected) << layer;
    EXPECT_NEAR(range.high, expected, tolerance * expected) << layer;
}

TEST_P(AnalyticRender, WhiteFurnaceReflectsAlbedoTimesTheSky)
{
    for (const int bounces : {0, 1}) {
        const LayeredImage image = render_scene(test::furnace(0.7f, 2.0f), 96, bounces);
        expect_uniform(image, "indirect", 0.7 * 2.0, 0.01);
        expect_uniform(image, "irradiance", kPi * 2.0, 0.01);
        EXPECT_EQ(range_of(image, "direct").high, 0.0);
        EXPECT_EQ(image.layers.at("beauty").at(0, 0)[0], 2.0f) << "the sky itself";
        EXPECT_EQ(image.layers.at("beauty").at(0, 0)[3], 0.0f);
    }
}

TEST_P(AnalyticRender, ClosedEmissiveBoxSumsTheGeometricSeries)
{
    for (const float albedo : {0.3f, 0.9f}) {
        const double rho = static_cast<double>(albedo);
        for (const int bounces : {0, 1}) {
            const LayeredImage image = render_scene(test::emissive_box(albedo, 3.0f), 96, bounces);
            expect_uniform(image, "emission", 3.0, 1e-6);
            const double expected = 3.0 * (1.0 - std::pow(rho, bounces + 2)) / (1.0 - rho);
            EXPECT_NEAR(range_of(image, "beauty").mean, expected, 0.01 * expected) << rho << ' ' << bounces;
            // Single pixels show the noise of area_samples = 8 shadow rays.
            expect_uniform(image, "direct", 3.0 * rho, 0.05);
            if (bounces == 0)
                EXPECT_EQ(range_of(image, "indirect").high, 0.0);
            else
                EXPECT_NEAR(range_of(image, "indirect").mean, 3.0 * rho * rho, 0.01 * 3.0 * rho * rho);
        }
    }
}

TEST_P(AnalyticRender, SphereWithCentralLightHasUniformIndirectIrradiance)
{
    const double rho = 0.6;
    const LayeredImage image = render_scene(test::lit_sphere(0.6f), 96, 1);
    expect_uniform(image, "direct", rho / kPi / 4.0, 0.01);
    // rho Phi / (4 pi r^2) with Phi = 4 pi [W] and r = 2.
    expect_uniform(image, "irradiance", rho / 4.0, 0.01);
    expect_uniform(image, "indirect", rho / kPi * rho / 4.0, 0.01);
}

TEST_P(AnalyticRender, SquareLampGivesLambertsIrradianceAtEveryPixel)
{
    const int size = 64;
    const LayeredImage image = render_scene(test::square_lamp(), size, 0);
    const Image& direct = image.layers.at("direct");
    double relative_error = 0.0;
    double ratio = 0.0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double px = (x + 0.5) / size * 2.0 - 1.0;
            const double pz = (y + 0.5) / size * 2.0 - 1.0;
            const double expected = test::rectangle_irradiance(-1 - px, 1 - px, -1 - pz, 1 - pz, 1.0) / kPi;
            const double value = static_cast<double>(direct.at(x, y)[0]);
            relative_error += std::abs(value / expected - 1.0) / (size * size);
            ratio += value / expected / (size * size);
        }
    }
    EXPECT_LT(relative_error, 0.005);
    EXPECT_NEAR(ratio, 1.0, 0.002);
}

TEST_P(AnalyticRender, FloorBesideALitWallFollowsTheFormFactorIntoTheCorner)
{
    const int size = 64;
    const LayeredImage image = render_scene(test::lit_corner(), size, 1);
    const Image& irradiance = image.layers.at("irradiance");
    const double peak = 0.5 * kPi;
    for (int x = 0; x < size; ++x) {
        const double d = (x + 0.5) / size * 2.0;
        // The scene is the same for every row: their mean takes the records' noise out of a test of bias.
        double mean = 0.0;
        for (int y = 0; y < size; ++y) mean += static_cast<double>(irradiance.at(x, y)[0]) / size;
        EXPECT_NEAR(mean, test::wall_irradiance(d, 2.0), 0.02 * peak) << "column " << x;
    }
    EXPECT_EQ(range_of(image, "direct").high, 0.0);
}

TEST_P(AnalyticRender, SceneWithoutLightIsBlack)
{
    Scene scene = test::emissive_box(0.5f, 0.0f);
    const LayeredImage image = render_scene(scene, 32, 1);
    EXPECT_EQ(range_of(image, "beauty").high, 0.0);
}

TEST_P(AnalyticRender, EmptySceneShowsTheSky)
{
    Scene scene;
    scene.sky_radiance = glm::vec3(0.5f);
    scene.cameras = {look_at_camera("camera", {0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 0.8)};
    const LayeredImage image = render_scene(scene, 16, 1);
    EXPECT_EQ(image.layers.at("beauty").at(8, 8)[0], 0.5f);
    EXPECT_EQ(image.layers.at("beauty").at(8, 8)[3], 0.0f);
}

TEST_P(AnalyticRender, AntiAliasedFurnaceShowsNoHalo)
{
    // Sphere and sky: a pixel on the silhouette is a mix of 1.4 and 2, never outside of the two.
    const LayeredImage image = render_scene(test::furnace(0.7f, 2.0f), 96, 1, 4);
    for (std::size_t i = 0; i < image.layers.at("beauty").pixels.size(); i += 4) {
        const float value = image.layers.at("beauty").pixels[i];
        ASSERT_GE(value, 1.4f * 0.99f);
        ASSERT_LE(value, 2.0f * 1.01f);
    }
}

std::string name_of(const testing::TestParamInfo<SplatMethod>& method)
{
    return method.param == SplatMethod::tiles ? "tiles" : "quads";
}
INSTANTIATE_TEST_SUITE_P(BothSplatters, AnalyticRender, testing::Values(SplatMethod::tiles, SplatMethod::quads),
                         name_of);

}  // namespace
}  // namespace rcs
