#include "rcs/reference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "support/scenes.h"
#include "support/tracing.h"

namespace rcs {
namespace {

double value(const LayeredImage& image, const std::string& layer, int x, int y)
{
    return static_cast<double>(image.layers.at(layer).at(x, y)[1]);  // green
}

TEST(Reference, StandardErrorHoldsAgainstASecondSeed)
{
    const int size = 40;
    const Scene scene = test::furnished_room();
    const std::pair<const char*, const char*> layers[] = {{"beauty", "standard_error"},
                                                          {"indirect", "indirect_standard_error"}};
    for (const int aa : {1, 4}) {
        const LayeredImage a = test::trace(scene, size, {.samples = 256, .bounces = 1, .aa = aa, .seed = 1});
        const LayeredImage b = test::trace(scene, size, {.samples = 256, .bounces = 1, .aa = aa, .seed = 2});
        test::expect_sane(a);
        for (const auto& [layer, error_layer] : layers) {
            int within = 0;
            double squared_error = 0, squared_difference = 0;
            for (int y = 0; y < size; ++y) {
                for (int x = 0; x < size; ++x) {
                    const double difference = value(a, layer, x, y) - value(b, layer, x, y);
                    const double error = std::hypot(value(a, error_layer, x, y), value(b, error_layer, x, y));
                    within += std::abs(difference) <= 3.0 * error ? 1 : 0;
                    squared_error += error * error;
                    squared_difference += difference * difference;
                }
            }
            EXPECT_GT(within, 0.95 * size * size) << layer << ", aa " << aa;
            // An upper estimate, but no idle one: within a factor 10 of what the seeds differ by.
            EXPECT_LT(squared_difference, 1.2 * squared_error) << layer << ", aa " << aa;
            EXPECT_GT(squared_difference, 0.01 * squared_error) << layer << ", aa " << aa;
        }
    }
}

TEST(Reference, DirectLayerIsFarCleanerThanOnePercent)
{
    const int size = 40;
    const Scene scene = test::furnished_room();
    const LayeredImage a = test::trace(scene, size, {.samples = 1024, .bounces = 0, .seed = 1});
    const LayeredImage b = test::trace(scene, size, {.samples = 1024, .bounces = 0, .seed = 2});
    double squared = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double difference = value(a, "direct", x, y) - value(b, "direct", x, y);
            squared += 0.5 * difference * difference;
        }
    }
    const double rms = std::sqrt(squared / (size * size));
    EXPECT_LT(rms, 0.003 * test::mean(a, "direct"));
}

TEST(Reference, IsTheSameForAnyNumberOfThreads)
{
    for (const int aa : {1, 4}) {
        const ReferenceOptions options{.samples = 16, .bounces = 2, .aa = aa};
        const LayeredImage one = test::trace(test::furnished_room(), 20, options, 1);
        for (const int threads : {2, 3}) {
            const LayeredImage more = test::trace(test::furnished_room(), 20, options, threads);
            for (const auto& [name, layer] : one.layers) EXPECT_EQ(layer.pixels, more.layers.at(name).pixels) << name;
        }
    }
}

TEST(Reference, StrideTracesThePixelsOfTheFullImage)
{
    const ReferenceOptions full_options{.samples = 16, .bounces = 1};
    const LayeredImage full = test::trace(test::furnished_room(), 22, full_options);
    for (const int stride : {2, 5, 22}) {
        ReferenceOptions options = full_options;
        options.stride = stride;
        const LayeredImage part = test::trace(test::furnished_room(), 22, options);
        EXPECT_EQ(part.metadata.at("rcs:stride"), std::to_string(stride));
        for (const auto& [name, layer] : part.layers) {
            ASSERT_EQ(layer.width, (22 - stride / 2 + stride - 1) / stride);
            for (int y = 0; y < layer.height; ++y) {
                for (int x = 0; x < layer.width; ++x) {
                    const Image& whole = full.layers.at(name);
                    const float* expected = whole.at(stride / 2 + x * stride, stride / 2 + y * stride);
                    for (int c = 0; c < layer.channels; ++c) ASSERT_EQ(layer.at(x, y)[c], expected[c]) << name;
                }
            }
        }
    }
}

TEST(Reference, AntiAliasedSilhouettesAreCoverage)
{
    // The furnace's sphere fills a disc: alpha sums to its area. Its radius on the image plane at
    // distance 1 is tan(asin(1/3)), the image is 2 tan(0.4) wide.
    const int size = 32;
    const LayeredImage image = test::trace(test::furnace(0.5f, 1.0f), size, {.samples = 64, .bounces = 0, .aa = 16});
    double covered = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) covered += static_cast<double>(image.layers.at("beauty").at(x, y)[3]);
    const double radius = std::tan(std::asin(1.0 / 3.0)) / (2.0 * std::tan(0.4)) * size;
    const double area = std::numbers::pi * radius * radius;
    EXPECT_NEAR(covered, area, 0.005 * area);
}

TEST(Reference, ReportsProgressAndStopsWhenAsked)
{
    const Scene scene = test::furnace(0.5f, 1.0f);
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const View view = test::view_of(scene.cameras[0], 20, 20);
    std::vector<float> fractions;
    render_reference(rays, view, {.samples = 16}, pool, [&](std::string_view stage, float fraction) {
        EXPECT_EQ(stage, "reference");
        fractions.push_back(fraction);
        return true;
    });
    ASSERT_GE(fractions.size(), 3u);
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
    EXPECT_EQ(fractions.back(), 1.0f);

    try {
        const auto stop_half_way = [](std::string_view, float fraction) { return fraction < 0.5f; };
        render_reference(rays, view, {.samples = 16}, pool, stop_half_way);
        FAIL() << "was not cancelled";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::cancelled);
    }
}

TEST(Reference, RefusesOptionsOutOfRangeByName)
{
    const Scene scene = test::furnace(0.5f, 1.0f);
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool);
    const View view = test::view_of(scene.cameras[0], 20, 20);
    const std::pair<ReferenceOptions, std::string> cases[] = {
        {{.samples = 15}, "samples is 15, expected a value in [16, 1048576]"},
        {{.bounces = -1}, "bounces is -1"},
        {{.bounces = 65}, "bounces is 65"},
        {{.aa = 0}, "aa is 0"},
        {{.stride = 0}, "stride is 0"},
        {{.stride = 40}, "stride is 40, expected a value in [1, 39]"}};
    for (const auto& [options, message] : cases) {
        try {
            render_reference(rays, view, options, pool);
            FAIL() << message;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::bad_argument);
            EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
        }
    }
}

TEST(Reference, EmptySceneShowsTheSkyOnly)
{
    Scene scene;
    scene.sky_radiance = {0.25f, 0.5f, 1.0f};
    scene.cameras = {look_at_camera("camera", {0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 0.8)};
    const LayeredImage image = test::trace(scene, 4, {.samples = 16});
    EXPECT_EQ(image.layers.at("beauty").at(1, 1)[2], 1.0f);
    EXPECT_EQ(image.layers.at("beauty").at(1, 1)[3], 0.0f);
    EXPECT_EQ(image.layers.at("standard_error").at(1, 1)[0], 0.0f);
}

}  // namespace
}  // namespace rcs
