#include "rcs/render.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/gl_context.h"
#include "rcs/ray_scene.h"
#include "support/scenes.h"
#include "support/session.h"
#include "util/random.h"

namespace rcs {
namespace {

RenderOptions small(int size, int aa = 1)
{
    RenderOptions options;
    options.width = size;
    options.height = size;
    options.aa = aa;
    return options;
}

using test::render_first;

/// Whether every layer has the same bits; says which one has not.
void expect_same(const LayeredImage& a, const LayeredImage& b)
{
    ASSERT_EQ(a.layers.size(), b.layers.size());
    for (const auto& [name, layer] : a.layers) EXPECT_TRUE(layer.pixels == b.layers.at(name).pixels) << name;
}

class RenderDemo : public testing::TestWithParam<const char*> {
protected:
    Scene scene = load_scene(GetParam());
};

TEST_P(RenderDemo, GivesEveryLayerFiniteAndNotNegative)
{
    const RenderResult result = render_first(scene, small(96, 2));
    const std::vector<std::pair<std::string, int>> layers = {
        {"beauty", 4}, {"emission", 3}, {"direct", 3},  {"indirect", 3},     {"irradiance", 3},    {"albedo", 3},
        {"normal", 3}, {"depth", 1},    {"records", 1}, {"direct_error", 1}, {"indirect_error", 1}};
    EXPECT_EQ(result.image.layers.size(), layers.size());
    for (const auto& [name, channels] : layers) {
        ASSERT_TRUE(result.image.layers.contains(name)) << name;
        const Image& image = result.image.layers.at(name);
        EXPECT_EQ(image.width, 96);
        EXPECT_EQ(image.height, 96);
        EXPECT_EQ(image.channels, channels) << name;
        for (const float value : image.pixels) {
            ASSERT_TRUE(std::isfinite(value) || (name == "depth" && value > 0.0f)) << name;
            ASSERT_TRUE(value >= 0.0f || name == "normal") << name;
        }
    }
    for (const float value : result.image.layers.at("albedo").pixels) ASSERT_LE(value, 1.0f);
    EXPECT_EQ(result.stats.unserved_pixels, 0u);
    EXPECT_EQ(result.image.metadata.at("rcs:aa"), "2");
    EXPECT_EQ(result.image.metadata.at("rcs:seed"), "1");
    EXPECT_EQ(result.image.metadata.at("rcs:accuracy"), "0.2") << "as the command line takes it";
    EXPECT_EQ(result.image.metadata.at("rcs:size"), "96x96");
}

TEST_P(RenderDemo, BeautyIsEmissionPlusDirectPlusIndirect)
{
    const LayeredImage image = render_first(scene, small(96, 3)).image;
    const auto& layers = image.layers;
    for (int y = 0; y < 96; ++y) {
        for (int x = 0; x < 96; ++x) {
            for (int c = 0; c < 3; ++c) {
                const float sum = layers.at("emission").at(x, y)[c] + layers.at("direct").at(x, y)[c] +
                                  layers.at("indirect").at(x, y)[c];
                // Two additions in whichever order.
                ASSERT_NEAR(layers.at("beauty").at(x, y)[c], sum, 2.4e-7f * sum) << x << ' ' << y;
            }
        }
    }
}

TEST_P(RenderDemo, IndirectIsIrradianceTimesAlbedoOverPi)
{
    const LayeredImage image = render_first(scene, small(96)).image;
    for (int i = 0; i < 96 * 96 * 3; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const float expected =
            image.layers.at("irradiance").pixels[k] * image.layers.at("albedo").pixels[k] / 3.14159265f;
        ASSERT_NEAR(image.layers.at("indirect").pixels[k], expected, 1e-6f * expected + 1e-12f);
    }
}

TEST_P(RenderDemo, GivesTheSameBitsRunAfterRunAndForAnyNumberOfThreads)
{
    const RenderResult two = render_first(scene, small(96, 2), 2);
    expect_same(two.image, render_first(scene, small(96, 2), 2).image);
    const RenderResult one = render_first(scene, small(96, 2), 1);
    expect_same(two.image, one.image);
    EXPECT_EQ(one.records.size(), two.records.size());
    expect_same(two.image, render_first(scene, small(96, 2), 3).image);
}

TEST_P(RenderDemo, QuadsAndTilesAgreeAtEveryPixel)
{
    RenderOptions options = small(128);
    options.splat = SplatMethod::quads;
    const RenderResult quads = render_first(scene, options);
    options.splat = SplatMethod::tiles;
    const RenderResult tiles = render_first(scene, options);
    EXPECT_EQ(quads.stats.splat_method, "quads");
    EXPECT_EQ(tiles.stats.splat_method, "tiles");
    ASSERT_EQ(quads.records.size(), tiles.records.size()) << "placement does not depend on the GL";
    for (const char* name : {"beauty", "indirect", "irradiance"}) {
        double worst = 0.0;
        const Image& a = quads.image.layers.at(name);
        const Image& b = tiles.image.layers.at(name);
        for (std::size_t i = 0; i < a.pixels.size(); ++i) {
            const double difference = std::abs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]));
            if (difference > 0.0)
                worst = std::max(worst, difference / static_cast<double>(std::max(a.pixels[i], b.pixels[i])));
        }
        EXPECT_LT(worst, 1e-4) << name;
    }
}

TEST_P(RenderDemo, MorePassesKeepTheMeanAndReuseTheRecords)
{
    const RenderResult one = render_first(scene, small(96, 1));
    const RenderResult four = render_first(scene, small(96, 4));
    const auto mean = [](const LayeredImage& image, const char* layer) {
        double sum = 0.0;
        for (const float value : image.layers.at(layer).pixels) sum += static_cast<double>(value);
        return sum;
    };
    for (const char* layer : {"direct", "indirect", "albedo"}) {
        // The passes see other points of the same picture: 96 x 96 samples of textures and shadow edges.
        EXPECT_NEAR(mean(four.image, layer) / mean(one.image, layer), 1.0, 0.015) << layer;
    }
    EXPECT_LT(four.records.size(), 2 * one.records.size());
}

TEST_P(RenderDemo, ACacheOfTheSameViewNeedsNoNewRecord)
{
    RenderResult first = render_first(scene, small(96));
    RenderResult second = render_first(scene, small(96), 2, first.records);
    EXPECT_EQ(second.stats.records.records, 0u);
    EXPECT_EQ(second.stats.records.hemisphere_rays, 0u);
    // Judged by probes, which records taught here who sees which light, and did not there.
    for (RenderResult* r : {&first, &second}) r->image.layers.erase("indirect_error");
    expect_same(first.image, second.image);
}

TEST_P(RenderDemo, AnotherSeedIsAnotherNoiseOfTheSamePicture)
{
    RenderOptions options = small(96);
    const LayeredImage first = render_first(scene, options).image;
    options.seed = 2;
    const LayeredImage second = render_first(scene, options).image;
    EXPECT_NE(first.layers.at("indirect").pixels, second.layers.at("indirect").pixels);
    EXPECT_EQ(first.layers.at("albedo").pixels, second.layers.at("albedo").pixels);
    EXPECT_EQ(first.layers.at("depth").pixels, second.layers.at("depth").pixels);
}

TEST_P(RenderDemo, WithoutABounceHasNoIndirectLightAndTheSameDirect)
{
    RenderOptions options = small(64);
    const LayeredImage one = render_first(scene, options).image;
    options.bounces = 0;
    const RenderResult none = render_first(scene, options);
    if (scene.sky_radiance == glm::vec3(0.0f)) {
        EXPECT_TRUE(none.records.empty());
        for (const float value : none.image.layers.at("indirect").pixels) ASSERT_EQ(value, 0.0f);
    }
    EXPECT_EQ(one.layers.at("direct").pixels, none.image.layers.at("direct").pixels);
}

INSTANTIATE_TEST_SUITE_P(Scenes, RenderDemo, testing::Values("demo:cornell", "demo:atrium"),
                         [](const auto& scene) { return std::string(scene.param).substr(5); });

TEST(RenderAntiAliased, SilhouettesAreCoverageWithoutHalos)
{
    // A sphere lit by a point light in front of nothing: the picture is coverage x what the sphere reflects.
    Scene scene;
    test::add_mesh(scene, test::icosphere(glm::vec3(0.0f), 1.0f, 4, test::add_material(scene, glm::vec3(0.5f))));
    test::add_mesh(scene, test::quad({-9, -1.2f, -9}, {0, 0, 18}, {18, 0, 0}, 0));
    scene.lights = {test::point_light({1.0, 3.0, 3.0}, glm::vec3(20.0f))};
    scene.cameras = {look_at_camera("camera", {0.0, 0.0, 4.0}, {0.0, 0.4, 0.0}, 0.6)};
    const int size = 96;
    const LayeredImage image = render_first(scene, small(size, 4)).image;
    const Image& beauty = image.layers.at("beauty");
    int edge = 0, background = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const float alpha = beauty.at(x, y)[3];
            ASSERT_EQ(alpha * 4.0f, std::round(alpha * 4.0f)) << "one of four passes covers the pixel or does not";
            edge += alpha > 0.0f && alpha < 1.0f ? 1 : 0;
            if (alpha > 0.0f) continue;
            ++background;
            for (const auto& [name, layer] : image.layers) {
                if (name == "depth") continue;
                for (int c = 0; c < layer.channels; ++c)
                    ASSERT_EQ(layer.at(x, y)[c], 0.0f) << name << ' ' << x << ' ' << y;
            }
            ASSERT_TRUE(std::isinf(image.layers.at("depth").at(x, y)[0]));
        }
    }
    EXPECT_GT(edge, size / 2);
    EXPECT_GT(background, size * size / 10);
    // A partly covered pixel shows no more than the brightest of its covered neighbours, per coverage.
    for (const char* layer : {"direct", "indirect", "albedo"}) {
        const Image& values = image.layers.at(layer);
        for (int y = 2; y + 2 < size; ++y) {
            for (int x = 2; x + 2 < size; ++x) {
                const float alpha = beauty.at(x, y)[3];
                if (alpha == 0.0f || alpha == 1.0f) continue;
                float brightest = 0.0f;
                for (int dy = -2; dy <= 2; ++dy)
                    for (int dx = -2; dx <= 2; ++dx)
                        if (beauty.at(x + dx, y + dy)[3] == 1.0f)
                            brightest = std::max(brightest, values.at(x + dx, y + dy)[0]);
                // 25 %: light changes quickly towards a silhouette.
                ASSERT_LE(values.at(x, y)[0], 1.25f * alpha * brightest) << layer << ' ' << x << ' ' << y;
            }
        }
    }
}

TEST(Render, DepthAndNormalOfAWallAreThoseOfTheWall)
{
    Scene scene;
    test::add_mesh(scene, test::quad({-9, -9, -5}, {18, 0, 0}, {0, 18, 0}, test::add_material(scene, glm::vec3(0.5f))));
    scene.cameras = {look_at_camera("camera", {0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 0.8)};
    const LayeredImage image = render_first(scene, small(33)).image;
    EXPECT_NEAR(image.layers.at("depth").at(16, 16)[0], 5.0f, 1e-5f);
    const double slope = std::tan(0.4) * 32.0 / 33.0;  // centre of the corner pixel
    EXPECT_NEAR(image.layers.at("depth").at(0, 0)[0], 5.0 * std::sqrt(1.0 + 2.0 * slope * slope), 1e-4);
    EXPECT_EQ(image.layers.at("normal").at(3, 3)[2], 1.0f);
}

TEST(Render, ReportsItsStagesInOrderAndTheirTimes)
{
    const RenderResult result = render_first(test::furnished_room(), small(48, 2));
    std::vector<std::string> names;
    for (const auto& [name, seconds] : result.stats.stage_seconds) {
        names.push_back(name);
        EXPECT_GE(seconds, 0.0);
    }
    EXPECT_EQ(names, (std::vector<std::string>{"plan", "gbuffer", "lamps", "direct", "records", "contacts", "splat",
                                               "estimate", "probes", "compose"}));
    EXPECT_EQ(result.stats.records.records, result.records.size());
    EXPECT_GT(result.stats.splats.splats, 0u);
    EXPECT_GT(result.stats.splats.samples, 0u);
    EXPECT_GT(result.stats.direct_shadow_rays, 0u);
    EXPECT_EQ(result.stats.threads, 2);
    EXPECT_FALSE(result.stats.gl_renderer.empty());
}

TEST(Render, StopsWhenAskedAtAnyStage)
{
    const Scene scene = test::furnished_room();
    for (int allowed = 0; allowed < 6; ++allowed) {
        int calls = 0;
        try {
            render_first(scene, small(32), 2, {},
                         {.progress = [&](std::string_view, float) { return calls++ < allowed; }});
            FAIL() << "went on after " << allowed;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::cancelled) << e.what();
        }
    }
    EXPECT_EQ(render_first(scene, small(32)).stats.unserved_pixels, 0u) << "and works again";
}

TEST(Render, RecordsTakeNoMoreRaysThanRefinementAllows)
{
    const Scene scene = load_scene("demo:cornell");
    for (const int refinement : {1, 4, 16}) {
        RenderOptions options = small(64);
        settings_of(options) = {.rays = 32, .noise_target = 1e-3f, .refinement = refinement};
        const RenderResult result = render_first(scene, options);
        const auto rays = [](const Record& a, const Record& b) { return a.rays < b.rays; };
        const int most = std::max_element(result.records.begin(), result.records.end(), rays)->rays;
        // M x N strata come near the number asked for, and more are as many again.
        EXPECT_LE(most, 1.1 * refinement * 32);
        EXPECT_GE(most, 0.7 * refinement * 32);
        EXPECT_EQ(result.stats.records.refined > 0, refinement > 1);
    }
}

TEST(Render, TakesPicturesOfOnePixelAndOfOneRow)
{
    for (const auto& [width, height] : {std::pair{1, 1}, {200, 1}, {1, 77}}) {
        RenderOptions options;
        options.width = width;
        options.height = height;
        const RenderResult result = render_first(test::furnished_room(), options);
        EXPECT_EQ(result.image.layers.at("beauty").width, width);
        EXPECT_EQ(result.stats.unserved_pixels, 0u);
        for (const float value : result.image.layers.at("beauty").pixels) ASSERT_TRUE(std::isfinite(value));
    }
}

/// Mean square difference of the direct light of two pictures.
double difference_of_direct(const LayeredImage& a, const LayeredImage& b)
{
    const std::vector<float>&x = a.layers.at("direct").pixels, &y = b.layers.at("direct").pixels;
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i)
        sum += static_cast<double>(x[i] - y[i]) * static_cast<double>(x[i] - y[i]);
    return sum / static_cast<double>(x.size());
}

TEST(Render, NoTwoPassesOfAnySeedsHaveOneSeed)
{
    std::set<std::uint64_t> seeds;
    for (std::uint64_t seed = 0; seed < 500; ++seed)
        for (int pass = 0; pass < 64; ++pass) seeds.insert(pass_seed(seed, pass));
    EXPECT_EQ(seeds.size(), 500u * 64u);
    EXPECT_EQ(pass_seed(7, 0), 7u);
}

TEST(Render, PicturesOfNeighbouringSeedsDifferAsMuchAsThoseOfAnySeeds)
{
    const Scene scene = load_scene("demo:cornell");
    RenderOptions options = small(96, 4);
    options.bounces = 0;
    options.area_samples = options.penumbra_samples = 4;
    options.effects.with.set(Effect::anti_aliasing);  // every sample by itself
    const auto of_seed = [&](std::uint64_t seed) {
        options.seed = seed;
        return render_first(scene, options).image;
    };
    double near = 0.0, far = 0.0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const LayeredImage image = of_seed(seed);
        near += difference_of_direct(image, of_seed(seed + 1));
        far += difference_of_direct(image, of_seed(seed + 1000));
    }
    EXPECT_GT(far, 0.0);
    EXPECT_GT(near / far, 0.8);  // 0.57 where three of four passes have random numbers in common, at other places
}

TEST(ValidateRenderOptions, NamesTheFieldItsValueAndItsRange)
{
    const auto message = [](auto change) -> std::string {
        RenderOptions options;
        change(options);
        try {
            validate(options);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            EXPECT_NE(std::string(e.what()).find("expected"), std::string::npos);
            return e.what();
        }
        return "no error";
    };
    const auto starts = [&](auto change, const std::string& start) {
        const std::string text = message(change);
        EXPECT_EQ(text.substr(0, start.size()), start);
    };
    EXPECT_EQ(message([](RenderOptions&) {}), "no error");
    starts([](RenderOptions& o) { o.width = 0; }, "width is 0,");
    starts([](RenderOptions& o) { o.width = 16385; }, "width is 16385,");
    starts([](RenderOptions& o) { o.height = -3; }, "height is -3,");
    starts([](RenderOptions& o) { o.aa = 0; }, "aa is 0,");
    starts([](RenderOptions& o) { o.aa = 257; }, "aa is 257,");
    starts([](RenderOptions& o) { o.bounces = 65; }, "bounces is 65,");
    starts([](RenderOptions& o) { o.bounces = -1; }, "bounces is -1,");
    starts([](RenderOptions& o) { o.overlap = 0.5f; }, "overlap is 0.5,");
    starts([](RenderOptions& o) { o.overlap = std::numeric_limits<float>::quiet_NaN(); }, "overlap is nan,");
    starts([](RenderOptions& o) { o.overlap = 17.0f; }, "overlap is 17,");
    starts([](RenderOptions& o) { settings_of(o).error_tolerance = -1.0f; }, "error_tolerance is -1");
    starts([](RenderOptions& o) { settings_of(o).rays = 3; }, "rays is 3,");
    starts([](RenderOptions& o) { o.area_samples = 0; }, "area_samples is 0,");
    starts([](RenderOptions& o) { o.penumbra_samples = 0; }, "penumbra_samples is 0,");
}

}  // namespace
}  // namespace rcs
