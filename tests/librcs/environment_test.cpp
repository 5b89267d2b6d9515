#include "scene/environment.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/image_io.h"
#include "support/temporary_folder.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

EnvironmentImage image(int width, int height, glm::vec3 value)
{
    EnvironmentImage result;
    result.name = "image";
    result.width = width;
    result.height = height;
    result.radiance.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value);
    return result;
}

glm::vec3& texel(EnvironmentImage& i, int x, int y)
{
    return i.radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(i.width) + static_cast<std::size_t>(x)];
}

/// A gradient with two suns, one at the seam and one at the pole.
Scene two_suns(int width, int height)
{
    Scene scene;
    scene.environment = image(width, height, glm::vec3(0.0f));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            texel(scene.environment, x, y) = {0.2f + 0.1f * static_cast<float>(y) / static_cast<float>(height), 0.3f,
                                              0.5f + 0.2f * std::sin(0.1f * static_cast<float>(x))};
    texel(scene.environment, 0, height / 4) = {900.0f, 700.0f, 400.0f};
    texel(scene.environment, width - 1, height / 4) = {300.0f, 800.0f, 100.0f};
    texel(scene.environment, width / 3, 0) = {500.0f, 500.0f, 900.0f};
    scene.sky_radiance = {0.05f, 0.0f, 0.1f};
    return scene;
}

/// Midpoint sum over the sphere, fine enough to resolve each texel's four bilinear quarters.
template <typename Function>
glm::dvec3 integrate(int width, int height, const Function& f)
{
    glm::dvec3 sum(0.0);
    for (int y = 0; y < height; ++y) {
        const double theta = kPi * (y + 0.5) / height;
        for (int x = 0; x < width; ++x) {
            const double phi = 2.0 * kPi * (x + 0.5) / width;
            const glm::vec3 d(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
            sum += glm::dvec3(f(d)) * std::sin(theta);
        }
    }
    return sum * (2.0 * kPi * kPi / (static_cast<double>(width) * height));
}

void expect_near(glm::dvec3 a, glm::dvec3 b, double relative)
{
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], relative * std::abs(b[c]) + 1e-9) << c;
}

TEST(Environment, ConstantImageIsAConstantSkyBitByBit)
{
    Scene scene;
    scene.environment = image(64, 32, {0.3f, 0.7f, 1.1f});
    scene.environment.rotation = 1.3;
    const Environment sky(scene);
    EXPECT_FALSE(sky.has_peaks());
    EXPECT_GE(sky.threshold(), 1.1f);
    RandomStream random(3);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 d = glm::normalize(glm::vec3(random.next(), random.next(), random.next()) - 0.5f);
        EXPECT_EQ(sky.radiance(d), glm::vec3(0.3f, 0.7f, 1.1f));
        EXPECT_EQ(sky.soft(d), glm::vec3(0.3f, 0.7f, 1.1f));
        EXPECT_EQ(sky.peak(d), glm::vec3(0.0f));
        EXPECT_NEAR(sky.soft_blurred(d).g, 0.7f, 1e-6f);
    }
}

TEST(Environment, LooksUpWhereTheConventionSays)
{
    Scene scene;
    scene.environment = image(8, 4, glm::vec3(0.0f));
    for (int x = 0; x < 8; ++x) {
        texel(scene.environment, x, 0) = {1, 0, 0};
        texel(scene.environment, x, 3) = {0, 1, 0};
    }
    for (int y = 1; y < 3; ++y) {
        for (int x = 3; x <= 4; ++x) texel(scene.environment, x, y) = {0, 0, 1};  // the middle
        for (int x = 5; x <= 6; ++x) texel(scene.environment, x, y) = {1, 1, 0};  // a quarter to its right
    }
    const auto look = [&](glm::vec3 d) { return Environment(scene).radiance(d); };
    EXPECT_EQ(look({0, 1, 0}), glm::vec3(1, 0, 0));
    EXPECT_EQ(look({0, -1, 0}), glm::vec3(0, 1, 0));
    EXPECT_NEAR(glm::distance(look({0, 0, -1}), glm::vec3(0, 0, 1)), 0.0f, 1e-5f);
    EXPECT_NEAR(glm::distance(look({1, 0, 0}), glm::vec3(1, 1, 0)), 0.0f, 1e-5f);
    EXPECT_NEAR(glm::distance(look({-1, 0, 0}), glm::vec3(0)), 0.0f, 1e-5f);
    // Counter-clockwise seen from above, a quarter turn brings what was at -Z to -X.
    scene.environment.rotation = 0.5 * kPi;
    EXPECT_NEAR(glm::distance(look({-1, 0, 0}), glm::vec3(0, 0, 1)), 0.0f, 1e-5f);
    EXPECT_NEAR(glm::distance(look({0, 0, -1}), glm::vec3(1, 1, 0)), 0.0f, 1e-5f);
}

TEST(Environment, SoftAndPeaksAddUpAndTheSunDoesNotMoveTheThreshold)
{
    Scene scene = two_suns(64, 32);
    const Environment sky(scene);
    ASSERT_TRUE(sky.has_peaks());
    RandomStream random(5);
    for (int i = 0; i < 2000; ++i) {
        const glm::vec3 d = glm::normalize(glm::vec3(random.next(), random.next(), random.next()) - 0.5f);
        expect_near(sky.soft(d) + sky.peak(d), sky.radiance(d), 1e-5);
        const glm::vec3 soft = sky.soft(d) - scene.sky_radiance;
        EXPECT_LE(std::max({soft.r, soft.g, soft.b}), sky.threshold() * 1.0001f);
    }
    for (glm::vec3& value : scene.environment.radiance)
        if (value.g > 100.0f) value *= 1000.0f;
    EXPECT_NEAR(Environment(scene).threshold(), sky.threshold(), 0.02f * sky.threshold());
    // Both parts of the small image hold the energy of the soft part.
    expect_near(integrate(1024, 512, [&](glm::vec3 d) { return sky.soft_blurred(d); }),
                integrate(1024, 512, [&](glm::vec3 d) { return sky.soft(d); }), 0.01);
}

TEST(Environment, OneSunInTheDarkIsAllPeak)
{
    Scene scene;
    scene.environment = image(128, 64, glm::vec3(0.0f));
    texel(scene.environment, 20, 20) = glm::vec3(1000.0f);
    const Environment sky(scene);
    EXPECT_EQ(sky.threshold(), 0.0f);
    expect_near(integrate(1024, 512, [&](glm::vec3 d) { return sky.soft(d); }), glm::dvec3(0.0), 1e-9);
    const Environment::Sample s = sky.sample_peak({0.3f, 0.6f});
    EXPECT_GT(sky.peak_estimate(s.direction), 0.9f * sky.peak_flux());
    EXPECT_EQ(sky.peak_estimate(-s.direction), 0.0f);
}

TEST(Environment, DensitiesIntegrateToOne)
{
    const Scene scene = two_suns(64, 32);
    const Environment sky(scene);
    expect_near(integrate(2048, 1024, [&](glm::vec3 d) { return glm::vec3(sky.peak_density(d)); }), glm::dvec3(1.0),
                2e-3);
    expect_near(integrate(2048, 1024, [&](glm::vec3 d) { return glm::vec3(sky.density(d)); }), glm::dvec3(1.0), 2e-3);
}

TEST(Environment, SampledIntegralsAgreeWithMidpointSums)
{
    Scene scene = two_suns(64, 32);
    scene.environment.rotation = -0.7;
    const Environment sky(scene);
    const glm::vec3 normal = glm::normalize(glm::vec3(0.3f, 0.8f, -0.4f));
    const auto lit = [&](glm::vec3 radiance, glm::vec3 d) { return radiance * std::max(0.0f, glm::dot(normal, d)); };
    glm::dvec3 peaks(0.0), whole(0.0);
    // Jittered: the pole's few strata would not average out by midpoints.
    const int side = 512;
    RandomStream random(9);
    for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
            const glm::vec2 u((static_cast<float>(i) + random.next()) / side,
                              (static_cast<float>(j) + random.next()) / side);
            const Environment::Sample p = sky.sample_peak(u), w = sky.sample(u);
            ASSERT_GT(p.density, 0.0f);
            ASSERT_NEAR(glm::length(p.direction), 1.0f, 1e-5f);
            ASSERT_NEAR(p.density, sky.peak_density(p.direction), 1e-3f * p.density);
            // Exact but for colour, and the sine within a texel that a tent spans (at the pole, all of it).
            peaks += glm::dvec3(lit(p.radiance, p.direction) / p.density);
            if (w.density > 0.0f) whole += glm::dvec3(lit(w.radiance, w.direction) / w.density);
        }
    }
    const double n = side * side;
    expect_near(peaks / n, integrate(2048, 1024, [&](glm::vec3 d) { return lit(sky.peak(d), d); }), 5e-3);
    expect_near(whole / n, integrate(2048, 1024, [&](glm::vec3 d) { return lit(sky.radiance(d), d); }), 5e-3);
}

TEST(LoadEnvironment, RepairsWhatIsNoLightAndSaysSo)
{
    const test::TemporaryFolder folder;
    LayeredImage file;
    Image beauty(4, 2, 3);
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i) beauty.pixels[i] = static_cast<float>(i);
    beauty.pixels[0] = std::numeric_limits<float>::quiet_NaN();
    beauty.pixels[4] = -3.0f;
    beauty.pixels[5] = std::numeric_limits<float>::infinity();
    file.layers["beauty"] = beauty;
    const std::string path = folder / "sky.exr";
    ImageFileOptions options;
    options.format = PixelFormat::full_float;
    write_exr(path, file, options);
    std::string said;
    const EnvironmentImage loaded = load_environment(path, [&](LogLevel, std::string_view text) { said += text; });
    EXPECT_EQ(loaded.width, 4);
    EXPECT_EQ(loaded.height, 2);
    EXPECT_EQ(loaded.radiance[0], glm::vec3(0, 1, 2));
    EXPECT_EQ(loaded.radiance[1], glm::vec3(3, 0, 65504));
    EXPECT_EQ(loaded.radiance[7], glm::vec3(21, 22, 23));
    EXPECT_NE(said.find("3 values"), std::string::npos) << said;
}

TEST(LoadEnvironment, RefusesWithOneSentenceThatNamesTheFile)
{
    const test::TemporaryFolder folder;
    test::write_bytes(folder / "broken.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\nxx");
    test::write_bytes(folder / "text.exr", "no image");
    for (const char* name : {"broken.hdr", "text.exr", "missing.hdr"}) {
        try {
            load_environment(folder / name);
            FAIL() << name;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), std::string_view(name) == "missing.hdr" ? ErrorCode::not_found : ErrorCode::bad_file);
            EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
            EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
        }
    }
}

TEST(LoadEnvironment, ReadsRadianceFiles)
{
    const test::TemporaryFolder folder;
    std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n";
    for (int i = 0; i < 4; ++i)
        bytes += {static_cast<char>(128), static_cast<char>(64), static_cast<char>(32), static_cast<char>(131)};
    test::write_bytes(folder / "sky.hdr", bytes);
    const EnvironmentImage loaded = load_environment(folder / "sky.hdr");
    ASSERT_EQ(loaded.radiance.size(), 4u);
    EXPECT_NEAR(loaded.radiance[3].r, 4.0f, 0.05f);  // 128 / 256 x 2^3
    EXPECT_NEAR(loaded.radiance[3].b, 1.0f, 0.05f);
}

}  // namespace
}  // namespace rcs
