#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "radiance/lobes.h"
#include "support/lobes.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

struct Axes {
    glm::vec3 x, y, z;
};
Axes axes_about(glm::vec3 normal)
{
    const glm::vec3 z = glm::normalize(normal);
    const glm::vec3 x = glm::normalize(glm::cross(z, std::abs(z.x) < 0.7f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
    return {x, glm::cross(z, x), z};
}

/// Visits directions of equal solid angle over the hemisphere about z: visit(direction, solid angle).
void over_hemisphere(const Axes& axes, const std::function<void(glm::vec3, double)>& visit)
{
    constexpr int kRings = 128, kSpokes = 256;
    for (int i = 0; i < kRings; ++i)
        for (int j = 0; j < kSpokes; ++j) {
            const double z = (i + 0.5) / kRings, phi = (j + 0.5) / kSpokes * 2.0 * kPi, r = std::sqrt(1.0 - z * z);
            visit(static_cast<float>(r * std::cos(phi)) * axes.x + static_cast<float>(r * std::sin(phi)) * axes.y +
                      static_cast<float>(z) * axes.z,
                  2.0 * kPi / (kRings * kSpokes));
        }
}

std::array<double, kHarmonics> harmonics_in(glm::vec3 w)
{
    float x[kHarmonicLanes], y[kHarmonicLanes], z[kHarmonicLanes];
    std::fill(x, x + kHarmonicLanes, w.x);
    std::fill(y, y + kHarmonicLanes, w.y);
    std::fill(z, z + kHarmonicLanes, w.z);
    HarmonicLanes lanes;
    evaluate_harmonics(detail::harmonic_factors(), x, y, z, lanes);
    std::array<double, kHarmonics> values;
    for (std::size_t k = 0; k < kHarmonics; ++k) values[k] = static_cast<double>(lanes[k][3]);
    return values;
}

using Light = std::function<double(glm::vec3)>;

/// What the record would hold of that light.
std::array<double, kHarmonics> project(const Axes& axes, const Light& light)
{
    std::array<double, kHarmonics> sums{};
    over_hemisphere(axes, [&](glm::vec3 w, double solid_angle) {
        const auto values = harmonics_in(w);
        const double weight = light(w) * static_cast<double>(glm::dot(w, axes.z)) * solid_angle;
        for (std::size_t k = 0; k < kHarmonics; ++k) sums[k] += weight * values[k];
    });
    return sums;
}

double by_lobe(const Bsdf& bsdf, glm::vec3 outgoing, const std::array<double, kHarmonics>& radiance)
{
    const Lobe* lanes[kHarmonicLanes] = {};
    glm::vec3 normals[kHarmonicLanes] = {}, directions[kHarmonicLanes] = {};
    lanes[5] = bsdf.lobe;
    normals[5] = bsdf.normal;
    directions[5] = outgoing;
    HarmonicLanes lobes;
    evaluate_lobes(lanes, normals, directions, lobes);
    double sum = 0.0;
    for (std::size_t k = 0; k < kHarmonics; ++k) {
        sum += static_cast<double>(lobes[k][5]) * radiance[k];
        EXPECT_EQ(lobes[k][4], 0.0f) << "a lane without a lobe";
    }
    return sum;
}

double by_brute_force(const Bsdf& bsdf, const Axes& axes, glm::vec3 outgoing, const Light& light)
{
    double reflected = 0.0, albedo = 0.0;
    over_hemisphere(axes, [&](glm::vec3 w, double solid_angle) {
        const double weight =
            static_cast<double>(evaluate(bsdf, outgoing, w).g) * static_cast<double>(glm::dot(w, axes.z)) * solid_angle;
        reflected += weight * light(w);
        albedo += weight;
    });
    return reflected / albedo;
}

Bsdf surface(const Axes& axes, float alpha, float f0)
{
    return test::surface_of({make_lobe<Specular>(glm::vec3(f0), 1.0f, alpha)}, axes.z);
}

glm::vec3 seen_at(const Axes& axes, float cosine, float turn)
{
    const float sine = std::sqrt(1.0f - cosine * cosine);
    return sine * (std::cos(turn) * axes.x + std::sin(turn) * axes.y) + cosine * axes.z;
}

TEST(Harmonics, AreOrthonormal)
{
    const Axes up = axes_about({0, 0, 1}), down = axes_about({0, 0, -1});
    for (int k = 0; k < kHarmonics; ++k) {
        std::array<double, kHarmonics> sums{};
        for (const Axes& half : {up, down})
            over_hemisphere(half, [&](glm::vec3 w, double solid_angle) {
                const auto values = harmonics_in(w);
                for (std::size_t n = 0; n < kHarmonics; ++n)
                    sums[n] += values[static_cast<std::size_t>(k)] * values[n] * solid_angle;
            });
        for (int n = 0; n < kHarmonics; ++n)
            EXPECT_NEAR(sums[static_cast<std::size_t>(n)], n == k ? 1.0 : 0.0, 2e-3) << k << " and " << n;
        if (k >= 9 && k % 5 != 0) k += 2;  // a sample of the higher ones
    }
}

TEST(Lobes, ReflectAUniformSkyExactly)
{
    const Axes axes = axes_about({0.3f, -0.8f, 0.5f});
    const Light uniform = [](glm::vec3) { return 1.0; };
    const auto radiance = project(axes, uniform);
    for (const float alpha : {0.3f, 0.45f, 0.7f, 1.0f})
        for (const float f0 : {0.04f, 0.5f, 1.0f})
            for (const float cosine : {0.1f, 0.4f, 0.75f, 1.0f})
                EXPECT_NEAR(by_lobe(surface(axes, alpha, f0), seen_at(axes, cosine, 1.0f), radiance), 1.0, 0.01)
                    << alpha << " " << f0 << " " << cosine;
}

TEST(Lobes, FollowHardEdgedLightWithinTheStatedError)
{
    const Axes axes = axes_about({0.1f, 0.9f, 0.4f});
    double worst = 0.0, squares = 0.0;
    int count = 0;
    for (int n = 0; n < 24; ++n) {
        const glm::vec3 towards =
            glm::normalize(glm::vec3(std::sin(2.4f * static_cast<float>(n)), std::cos(1.7f * static_cast<float>(n)),
                                     std::sin(0.9f * static_cast<float>(n) + 1.0f)));
        const Light half = [&](glm::vec3 w) { return 0.2 + (glm::dot(w, towards) > 0.1f ? 1.0 : 0.0); };
        const auto radiance = project(axes, half);
        for (const float alpha : {0.3f, 0.5f, 1.0f}) {
            for (const float cosine : {0.5f, 0.9f}) {
                const Bsdf bsdf = surface(axes, alpha, 0.04f);
                const glm::vec3 outgoing = seen_at(axes, cosine, 0.7f * static_cast<float>(n));
                const double exact = by_brute_force(bsdf, axes, outgoing, half);
                const double error = by_lobe(bsdf, outgoing, radiance) / exact - 1.0;
                worst = std::max(worst, std::abs(error));
                squares += error * error;
                ++count;
            }
        }
    }
    EXPECT_LT(std::sqrt(squares / count), 0.03);
    EXPECT_LT(worst, 0.2);
}

TEST(Lobes, TurnWithTheScene)
{
    double first = 0.0;
    for (const glm::vec3 normal : {glm::vec3(0, 0, 1), glm::vec3(0.6f, -0.7f, 0.2f), glm::vec3(-1, 0.1f, -0.5f)}) {
        const Axes axes = axes_about(normal);
        const glm::vec3 towards = seen_at(axes, 0.6f, 2.0f);
        const auto radiance =
            project(axes, [&](glm::vec3 w) { return std::exp(4.0 * static_cast<double>(glm::dot(w, towards))); });
        const double value = by_lobe(surface(axes, 0.4f, 0.9f), seen_at(axes, 0.5f, 4.6f), radiance);
        if (first == 0.0) first = value;
        EXPECT_NEAR(value, first, 2e-4 * first);
    }
}

}  // namespace
}  // namespace rcs
