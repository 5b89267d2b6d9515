// Lobes beyond metal and dielectric, each against its own formulas.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "material/bsdf.h"
#include "support/lobe_samples.h"

namespace rcs::test {
namespace {

/// KHR_materials_sheen's own formulas, in double precision: D V of the sheen lobe.
double charlie(double roughness, glm::dvec3 o, glm::dvec3 i)
{
    const double alpha = roughness * roughness, inverse = 1.0 / alpha;
    const auto l = [&](double x) {
        const double t = (1.0 - alpha) * (1.0 - alpha);
        return std::lerp(21.5473, 25.3245, t) /
                   (1.0 + std::lerp(3.82987, 3.32435, t) * std::pow(x, std::lerp(0.19823, 0.16801, t))) +
               std::lerp(-1.97760, -1.27393, t) * x + std::lerp(-4.32054, -4.85967, t);
    };
    const auto lambda = [&](double x) { return x < 0.5 ? std::exp(l(x)) : std::exp(2.0 * l(0.5) - l(1.0 - x)); };
    const glm::dvec3 h = glm::normalize(o + i);
    const double d = (2.0 + inverse) * std::pow(std::sqrt(h.x * h.x + h.y * h.y), inverse) / (2.0 * kPi);
    return d / ((1.0 + lambda(o.z) + lambda(i.z)) * 4.0 * o.z * i.z);
}

/// Calls visit(unit direction, its solid angle) over the upper hemisphere, denser near the horizon.
template <typename Visit>
void over_hemisphere(const Visit& visit)
{
    constexpr int kRows = 600, kColumns = 360;
    for (int row = 0; row < kRows; ++row) {
        const double t = (row + 0.5) / kRows, z = t * t * t, r = std::sqrt(1.0 - z * z);
        for (int column = 0; column < kColumns; ++column) {
            const double phi = 2.0 * kPi * (column + 0.5) / kColumns;
            visit(glm::dvec3(r * std::cos(phi), r * std::sin(phi), z), 3.0 * t * t / kRows * 2.0 * kPi / kColumns);
        }
    }
}

TEST(DiffuseTransmission, ScattersTheLightOfTheOtherSideEvenly)
{
    for (const float cosine : kCosines) {
        const Bsdf b = leaf({0.6f, 0.4f, 0.2f}, {0.4f, 0.6f, 0.8f});
        const glm::vec3 o = direction(cosine);
        const float left = 1.0f - specular_albedo(b, cosine).r;
        EXPECT_NEAR(evaluate(b, o, direction(-0.3f)).g, 0.4f * left / static_cast<float>(kPi), 1e-6f);
        EXPECT_EQ(evaluate(b, o, direction(-0.3f)), evaluate(b, o, direction(-0.9f, 2.0f)));
        glm::dvec3 sum(0.0);
        constexpr int kCount = 128;
        for_each_sample(kCount, [&](float choice, glm::vec2 u) {
            sum += glm::dvec3(sample(b, o, choice, u).weight) / double(kCount * kCount);
        });
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], 1.0, 0.01) << "cosine " << cosine;
    }
}

TEST(Anisotropic, AWhiteMetalReflectsEverythingFromAllSides)
{
    for (const float roughness : {0.1f, 0.25f, 0.45f, 0.7f, 0.9f, 1.0f}) {
        for (const float strength : {0.15f, 0.4f, 0.6f, 0.8f, 1.0f}) {
            const Bsdf b = brushed(roughness, strength);
            const double at = static_cast<double>(stretched_widths(b.lobe[0].alpha, b.lobe[0].stretch()).x),
                         ab = static_cast<double>(b.lobe[0].alpha);
            for (const float cosine : {0.05f, 0.2f, 0.5f, 0.9f}) {
                for (const float azimuth : {0.4f, 0.9f, 1.4f, 1.97f}) {
                    const glm::dvec3 o(direction(cosine, azimuth));
                    // Half vectors at slopes (at t cos, ab t sin), t = r / (1 - r): the Jacobian of i is 4 (o.h).
                    double sum = 0.0;
                    constexpr int kRadii = 200, kAngles = 180;
                    for (int i = 0; i < kRadii; ++i) {
                        const double r = (i + 0.5) / kRadii, t = r / (1.0 - r), rate = 1.0 / ((1.0 - r) * (1.0 - r));
                        for (int j = 0; j < kAngles; ++j) {
                            const double phi = 2.0 * kPi * (j + 0.5) / kAngles;
                            const double x = at * t * std::cos(phi), y = ab * t * std::sin(phi);
                            const double hz = 1.0 / std::sqrt(1.0 + x * x + y * y);
                            const double c = std::cos(static_cast<double>(b.lobe[0].turn())),
                                         s = std::sin(static_cast<double>(b.lobe[0].turn()));
                            const glm::dvec3 h = hz * glm::dvec3(c * x - s * y, s * x + c * y, 1.0);
                            const double oh = glm::dot(h, o);
                            const glm::dvec3 in = 2.0 * oh * h - o;
                            if (oh <= 0.0 || in.z <= 0.0) continue;
                            sum += static_cast<double>(evaluate(b, glm::vec3(o), glm::vec3(in)).g) * in.z * 4.0 * oh *
                                   hz * hz * hz * at * ab * t * rate / kRadii * 2.0 * kPi / kAngles;
                        }
                    }
                    EXPECT_NEAR(sum, 1.0, 0.02) << "roughness " << roughness << " strength " << strength << " cosine "
                                                << cosine << " azimuth " << azimuth;
                }
            }
        }
    }
}

TEST(Anisotropic, IsTheIsotropicLobeWhereItsWidthsAreTheSame)
{
    const Bsdf round = metal(1.0f, {0.9f, 0.5f, 0.1f}), stretched = brushed(1.0f, 0.7f, {0.9f, 0.5f, 0.1f});
    const glm::vec3 o = direction(0.4f), i = direction(0.7f, 2.0f);
    EXPECT_NEAR(evaluate(round, o, i).g, evaluate(stretched, o, i).g, 0.01f * evaluate(round, o, i).g);
    EXPECT_NEAR(density(round, o, i), density(stretched, o, i), 1e-4f * density(round, o, i));
}

TEST(Anisotropic, IsWiderAlongItsDirection)
{
    const Bsdf b = brushed(0.2f, 0.7f, glm::vec3(1.0f), 0.4f);
    const glm::vec3 o(0.0f, 0.0f, 1.0f);
    EXPECT_GT(evaluate(b, o, direction(0.9f, 0.4f)).g, 10.0f * evaluate(b, o, direction(0.9f, 0.4f + 1.5708f)).g);
    // Turning all of it changes nothing.
    const Bsdf other = brushed(0.2f, 0.7f, glm::vec3(1.0f), 1.4f);
    EXPECT_NEAR(evaluate(b, direction(0.6f, 0.1f), direction(0.7f, 2.9f)).g,
                evaluate(other, direction(0.6f, 1.1f), direction(0.7f, 3.9f)).g, 1e-2f);
}

const std::vector<float> kSheens{0.07f, 0.1f, 0.17f, 0.3f, 0.5f, 0.75f, 1.0f};

TEST(Sheen, IsTheExtensionsLobeAsFarAsThatKeepsEnergy)
{
    for (const float roughness : kSheens) {
        for (const float cosine : kCosines) {
            const glm::vec3 o = direction(cosine, 0.0f);
            double total = 0.0;
            over_hemisphere([&](glm::dvec3 i, double solid_angle) {
                total += charlie(static_cast<double>(roughness), glm::dvec3(o), i) * i.z * solid_angle;
            });
            const std::string where = "roughness " + std::to_string(roughness) + " cosine " + std::to_string(cosine);
            const Bsdf b = sheen(roughness, {1.0f, 0.5f, 0.25f});
            EXPECT_NEAR(specular_albedo(b, cosine).r, std::min(total, 1.0), 0.005 + 0.01 * total) << where;
            for (const glm::vec3 i : {direction(0.2f, 3.0f), direction(0.05f, 1.0f), direction(0.7f, 2.0f)}) {
                const double expected =
                    charlie(static_cast<double>(roughness), glm::dvec3(o), glm::dvec3(i)) / std::max(1.0, total);
                EXPECT_NEAR(evaluate(b, o, i).g, 0.5 * expected, 0.01 * expected + 1e-6) << where;
            }
        }
    }
}

TEST(Sheen, AWhiteFurnaceStaysWhite)
{
    for (const float roughness : kSheens) {
        for (const float cosine : kCosines) {
            const Bsdf b = sheen(roughness, glm::vec3(1.0f), surface_of({make_lobe<Diffuse>(glm::vec3(1.0f))}));
            const glm::vec3 o = direction(cosine, 0.0f);
            double reflected = 0.0;
            over_hemisphere([&](glm::dvec3 i, double solid_angle) {
                reflected += static_cast<double>(evaluate(b, o, glm::vec3(i)).g) * i.z * solid_angle;
            });
            EXPECT_NEAR(reflected, 1.0, 0.02) << "roughness " << roughness << " cosine " << cosine;
        }
    }
}

TEST(Sheen, IsReciprocalWhereItsAlbedoIsNotCut)
{
    const Bsdf b = sheen(0.5f);
    const glm::vec3 there = evaluate(b, direction(0.2f), direction(0.7f, 2.0f));
    EXPECT_NEAR(there.r, evaluate(b, direction(0.7f, 2.0f), direction(0.2f)).r, 1e-5f * there.r);
}

TEST(Sheen, LeavesWhatItsLargestChannelDoesNotReflect)
{
    const Bsdf b = sheen(0.4f, {0.8f, 0.2f, 0.0f}, surface_of({make_lobe<Diffuse>({1.0f, 0.5f, 1.0f})}));
    const float left = 1.0f - 0.8f * charlie_albedo(0.3f, 0.16f);
    EXPECT_NEAR(diffuse_albedo(b, 0.3f).g, 0.5f * left, 1e-6f);
    EXPECT_NEAR(diffuse_albedo(b, 0.3f).b, left, 1e-6f);
}

}  // namespace
}  // namespace rcs::test
