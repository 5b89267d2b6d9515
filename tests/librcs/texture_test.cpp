#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "scene/texture.h"
#include "util/random.h"

namespace rcs::test {
namespace {

constexpr double kCode = 1.0 / 65535.0;  ///< one step of a stored texel

/// Random colours in [0, 1], repeatable.
std::vector<glm::vec3> random_texels(int width, int height, std::uint64_t seed = 1)
{
    RandomStream random(seed);
    std::vector<glm::vec3> texels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (glm::vec3& texel : texels) {
        texel.r = random.next();
        texel.g = random.next();
        texel.b = random.next();
    }
    return texels;
}

glm::dvec3 mean_of(const Texture::Level& level)
{
    glm::dvec3 sum(0.0);
    for (const auto& t : level.texels) sum += glm::dvec3(t[0], t[1], t[2]) / 65535.0;
    return sum / static_cast<double>(level.texels.size());
}

void expect_near(glm::dvec3 value, glm::dvec3 expected, double tolerance, const std::string& what = "")
{
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(value[c], expected[c], tolerance) << what << " channel " << c;
}

/// The plain definition, in doubles.
glm::dvec3 bilinear_oracle(const std::vector<glm::vec3>& texels, int width, int height, double u, double v)
{
    const double x = (u - std::floor(u)) * width - 0.5;
    const double y = (v - std::floor(v)) * height - 0.5;
    glm::dvec3 sum(0.0);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int column = static_cast<int>(std::floor(x)) + i;
            const int row = static_cast<int>(std::floor(y)) + j;
            const double weight = (1.0 - std::fabs(x - column)) * (1.0 - std::fabs(y - row));
            const auto index = static_cast<std::size_t>(((row + height) % height) * width + (column + width) % width);
            sum += weight * glm::dvec3(texels[index]);
        }
    }
    return sum;
}

TEST(MakeTexture, LevelsHalveDownToOneTexel)
{
    const Texture texture = make_texture("t", 13, 4, random_texels(13, 4));
    const std::vector<glm::ivec2> expected = {{13, 4}, {6, 2}, {3, 1}, {1, 1}};
    ASSERT_EQ(texture.levels.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_EQ(texture.levels[i].width, expected[i].x);
        EXPECT_EQ(texture.levels[i].height, expected[i].y);
    }
}

TEST(MakeTexture, EveryLevelKeepsTheMeanWhateverTheSize)
{
    for (const auto& [width, height] : {std::pair{64, 64}, {63, 65}, {1, 7}, {5, 1}, {1021, 150}, {47, 423}, {1, 1}}) {
        const Texture texture = make_texture("t", width, height, random_texels(width, height));
        const glm::dvec3 mean = mean_of(texture.levels[0]);
        for (std::size_t i = 1; i < texture.levels.size(); ++i) {
            // Each level rounds its texels once, by half a step at most.
            expect_near(mean_of(texture.levels[i]), mean, 0.5 * kCode * static_cast<double>(i),
                        std::to_string(width) + " x " + std::to_string(height) + " level " + std::to_string(i));
        }
    }
}

TEST(MakeTexture, AThirdOfThreeTexelsIsAveragedByArea)
{
    const Texture texture = make_texture("t", 5, 1, {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {1, 1, 1}});
    // Two texels out of five: [0, 2.5) and [2.5, 5).
    ASSERT_EQ(texture.levels[1].width, 2);
    expect_near(glm::dvec3(texel_value(texture.levels[1], 0, 0)), {0.4, 0.0, 0.0}, kCode);
    expect_near(glm::dvec3(texel_value(texture.levels[1], 1, 0)), {0.4, 0.8, 0.4}, kCode);
}

TEST(MakeTexture, ClampsToTheUnitRangeAndRefusesWrongSizes)
{
    const Texture texture = make_texture("t", 3, 1, {{2, -1, 0.5f}, {NAN, INFINITY, 0}, {1, 1, 1}});
    expect_near(glm::dvec3(sample_nearest(texture, {0.1f, 0.5f}, 0)), {1, 0, 0.5}, kCode);
    expect_near(glm::dvec3(sample_nearest(texture, {0.5f, 0.5f}, 0)), {0, 1, 0}, kCode);
    EXPECT_THROW(make_texture("t", 2, 2, {{0, 0, 0}}), Error);
    EXPECT_THROW(make_texture("t", 0, 0, {}), Error);
}

TEST(SampleNearest, RepeatsInAllDirectionsAndTakesAnyNumber)
{
    const int width = 5, height = 3;
    const std::vector<glm::vec3> texels = random_texels(width, height);
    const Texture texture = make_texture("t", width, height, texels);
    for (int y = -2 * height; y < 2 * height; ++y) {
        for (int x = -2 * width; x < 2 * width; ++x) {
            const glm::vec2 centre((static_cast<float>(x) + 0.5f) / width, (static_cast<float>(y) + 0.5f) / height);
            const auto index = static_cast<std::size_t>((y + 2 * height) % height * width + (x + 2 * width) % width);
            expect_near(glm::dvec3(sample_nearest(texture, centre, 0)), glm::dvec3(texels[index]), kCode);
        }
    }
    for (const float huge : {1e9f, -1e9f, 3e38f, -3e38f, 8388609.0f, -1e-30f, -1e-8f, 0.99999994f}) {
        const glm::vec4 value = sample_nearest(texture, {huge, -huge}, 0);
        EXPECT_TRUE(value.x >= 0.0f && value.x <= 1.0f);
        expect_near(glm::dvec3(sample_bilinear(texture, {huge, huge})), glm::dvec3(0.5), 0.5);
    }
    expect_near(glm::dvec3(sample_nearest(texture, {0.3f, 0.3f}, 99)), mean_of(texture.levels[0]), 3 * kCode);
    expect_near(glm::dvec3(sample_nearest(texture, {0.1f, 0.1f}, -5)), glm::dvec3(texels[0]), kCode);
}

TEST(SampleBilinear, AgreesWithItsDefinition)
{
    const int width = 7, height = 4;
    const std::vector<glm::vec3> texels = random_texels(width, height);
    const Texture texture = make_texture("t", width, height, texels);
    RandomStream random(7);
    for (int i = 0; i < 2000; ++i) {
        const glm::vec2 uv(6.0f * random.next() - 3.0f, 6.0f * random.next() - 3.0f);
        // A float uv of 3 has steps of 2.4e-7; seven texels of slope up to 1 a texel make that 2e-6.
        expect_near(glm::dvec3(sample_bilinear(texture, uv)), bilinear_oracle(texels, width, height, uv.x, uv.y),
                    kCode + 1e-5);
    }
}

TEST(SampleFiltered, MagnifiesBilinearly)
{
    const Texture texture = make_texture("t", 16, 16, random_texels(16, 16));
    RandomStream random(3);
    for (int i = 0; i < 100; ++i) {
        const glm::vec2 uv(random.next(), random.next());
        EXPECT_EQ(sample_filtered(texture, uv, {0.01f, 0.0f}, {0.0f, 0.03f}), sample_bilinear(texture, uv));
    }
}

TEST(SampleFiltered, AConstantStaysConstantAndAHugeFootprintSeesTheMean)
{
    const Texture plain = make_texture("t", 33, 20, std::vector<glm::vec3>(33 * 20, glm::vec3(0.25f, 0.5f, 0.75f)));
    const Texture noisy = make_texture("t", 33, 20, random_texels(33, 20));
    RandomStream random(4);
    const auto number = [&] { return 2.0f * random.next() - 1.0f; };
    for (int i = 0; i < 500; ++i) {
        const glm::vec2 uv(number(), number()), dx(number(), number()), dy(number(), number());
        // sums of up to 16 probes of eight floats
        expect_near(glm::dvec3(sample_filtered(plain, uv, dx, dy)), {0.25, 0.5, 0.75}, kCode + 1e-5);
        expect_near(glm::dvec3(sample_filtered(noisy, uv, 100.0f * dx, 100.0f * glm::vec2(-dx.y, dx.x))),
                    mean_of(noisy.levels[0]), 6 * kCode);
    }
    for (const float odd : {INFINITY, NAN, 1e30f, 3e38f}) {
        expect_near(glm::dvec3(sample_filtered(noisy, {0.5f, 0.5f}, {odd, odd}, {odd, -odd})), mean_of(noisy.levels[0]),
                    6 * kCode);
    }
    expect_near(glm::dvec3(sample_filtered(plain, {0.5f, 0.5f}, {0, 0}, {0, 0})), {0.25, 0.5, 0.75}, kCode + 1e-6);
}

/// Waves no shorter than 32 texels of 256.
glm::vec3 wave(double u, double v)
{
    const double tau = 6.283185307179586;
    return {0.5 + 0.4 * std::sin(tau * (3 * u + 2 * v)), 0.5 + 0.4 * std::sin(tau * 8 * u),
            0.5 + 0.4 * std::cos(tau * (5 * v - 4 * u))};
}

TEST(SampleFiltered, ApproachesTheMeanOverThePixelsParallelogram)
{
    constexpr int kSide = 256;
    std::vector<glm::vec3> texels;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) texels.push_back(wave((x + 0.5) / kSide, (y + 0.5) / kSide));
    }
    const Texture texture = make_texture("t", kSide, kSide, texels);
    RandomStream random(5);
    for (int i = 0; i < 200; ++i) {
        const float angle = 6.2831853f * random.next();
        const glm::vec2 along(std::cos(angle), std::sin(angle));
        const glm::vec2 dx = (4.0f + 36.0f * random.next()) / kSide * along;  // up to 40 texels long
        const glm::vec2 dy = (1.0f + 3.0f * random.next()) / kSide * glm::vec2(-along.y, along.x);
        const glm::vec2 uv(random.next(), random.next());
        glm::dvec3 mean(0.0);
        constexpr int kSteps = 64;
        for (int a = 0; a < kSteps; ++a) {
            const glm::vec2 p = uv + dx * ((static_cast<float>(a) + 0.5f) / kSteps - 0.5f);
            mean += glm::dvec3(wave(p.x, p.y)) / static_cast<double>(kSteps);
        }
        // Probes are up to 4 texels wide tents on box means: they damp a wave of 32 texels by
        // 1 - sinc(4/32)^3 = 8 % of its 0.4, and of that the true mean across dy takes up 3 %.
        expect_near(glm::dvec3(sample_filtered(texture, uv, dx, dy)), mean, 0.04);
    }
}

TEST(SampleFiltered, DoesNotDependOnHowThePixelGridIsTurned)
{
    const Texture texture = make_texture("t", 64, 64, random_texels(64, 64));
    const glm::vec2 dx(0.20f, 0.05f), dy(-0.01f, 0.05f);
    const glm::vec4 straight = sample_filtered(texture, {0.3f, 0.6f}, dx, dy);
    for (const float angle : {0.3f, 1.0f, 2.5f}) {
        const glm::vec2 a = std::cos(angle) * dx + std::sin(angle) * dy;
        const glm::vec2 b = -std::sin(angle) * dx + std::cos(angle) * dy;
        // The ellipse is the same up to rounding; log2 of its width moves the blend by about 1e-5.
        expect_near(glm::dvec3(sample_filtered(texture, {0.3f, 0.6f}, a, b)), glm::dvec3(straight), 1e-4);
    }
}

}  // namespace
}  // namespace rcs::test
