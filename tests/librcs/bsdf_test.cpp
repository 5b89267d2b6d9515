#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "material/bsdf.h"
#include "material/ggx.h"
#include "material/ggx_albedo.h"
#include "support/lobe_samples.h"
#include "util/random.h"

namespace rcs::test {
namespace {

/// Integral of f cos over both sides by a plain grid in the half vector's slope and azimuth, for lobes of any
/// width; the grid knows nothing of the sampling code.
glm::dvec3 albedo_by_quadrature(const Bsdf& b, glm::vec3 outgoing)
{
    // h at tan(theta) = alpha t / (1 - t): the Jacobian of i = reflect(o, h) is 4 (o.h).
    glm::dvec3 sum(0.0);
    constexpr int kRadii = 400, kAngles = 360;
    for (int i = 0; i < kRadii; ++i) {
        const double t = (i + 0.5) / kRadii;
        const double slope = static_cast<double>(b.lobe[0].alpha) * t / (1.0 - t);
        const double slope_rate = static_cast<double>(b.lobe[0].alpha) / ((1.0 - t) * (1.0 - t));
        const double cosine = 1.0 / std::sqrt(1.0 + slope * slope);
        const double solid_angle = slope * cosine * cosine * cosine * slope_rate / kRadii * 2.0 * kPi / kAngles;
        for (int j = 0; j < kAngles; ++j) {
            const double phi = 2.0 * kPi * (j + 0.5) / kAngles;
            const glm::dvec3 h(slope * cosine * std::cos(phi), slope * cosine * std::sin(phi), cosine);
            const double oh = glm::dot(h, glm::dvec3(outgoing));
            if (oh <= 0.0) continue;
            const glm::dvec3 in = 2.0 * oh * h - glm::dvec3(outgoing);
            if (in.z <= 0.0) continue;
            sum += glm::dvec3(evaluate_glossy(b, outgoing, glm::vec3(in))) * in.z * 4.0 * oh * solid_angle;
        }
    }
    return sum;
}

TEST(GgxAlbedo, MatchesTheIntegralAtAnyRoughnessAndAngle)
{
    for (const float roughness : {0.04f, 0.1f, 0.27f, 0.51f, 0.77f, 1.0f}) {
        for (const float cosine : {0.01f, 0.04f, 0.13f, 0.37f, 0.71f, 1.0f}) {
            const float alpha = roughness * roughness;
            glm::dvec2 sum(0.0);
            constexpr int kCount = 400;
            const glm::vec3 o = direction(cosine, 0.0f);
            for (int i = 0; i < kCount; ++i)
                for (int j = 0; j < kCount; ++j) {
                    const glm::vec3 h = sample_visible_normal(
                        o, alpha,
                        glm::vec2((static_cast<float>(i) + 0.5f) / kCount, (static_cast<float>(j) + 0.5f) / kCount));
                    const double oh = static_cast<double>(glm::dot(o, h));
                    const double ci = 2.0 * oh * static_cast<double>(h.z) - static_cast<double>(cosine);
                    if (ci <= 0.0) continue;
                    // G2 / G1 in Heitz's own words: (1 + Lambda_o) / (1 + Lambda_o + Lambda_i).
                    const auto lambda = [&](double c) {
                        return 0.5 * (std::sqrt(1.0 + static_cast<double>(alpha) * static_cast<double>(alpha) *
                                                          (1.0 / (c * c) - 1.0)) -
                                      1.0);
                    };
                    const double lo = lambda(static_cast<double>(cosine));
                    const double g = (1.0 + lo) / (1.0 + lo + lambda(ci));
                    const double f = std::pow(1.0 - oh, 5.0);
                    sum += glm::dvec2(g * (1.0 - f), g * f) / static_cast<double>(kCount * kCount);
                }
            const GgxAlbedo e = ggx_albedo(cosine, alpha);
            const std::string where = "roughness " + std::to_string(roughness) + " cosine " + std::to_string(cosine);
            EXPECT_NEAR(e.scale, sum.x, 0.005) << where;
            EXPECT_NEAR(e.bias, sum.y, 0.005) << where;
        }
    }
}

TEST(Bsdf, AWhiteMetalReflectsEverything)
{
    for (int r = 0; r <= 10; ++r) {
        for (const float cosine : kCosines) {
            const Bsdf b = metal(static_cast<float>(r) / 10.0f);
            const glm::vec3 o = direction(cosine);
            EXPECT_NEAR(specular_albedo(b, cosine).r, 1.0f, 1e-4f);
            EXPECT_NEAR(albedo_by_quadrature(b, o).r, 1.0, 0.01) << "roughness " << r / 10.0 << " cosine " << cosine;
        }
    }
}

TEST(Bsdf, DielectricsReflectNoMoreThanArrives)
{
    for (int r = 0; r <= 10; ++r) {
        for (const float cosine : kCosines) {
            const Bsdf b = plastic(static_cast<float>(r) / 10.0f);
            const glm::dvec3 glossy = albedo_by_quadrature(b, direction(cosine));
            const float stated = specular_albedo(b, cosine).r;
            EXPECT_NEAR(glossy.r, static_cast<double>(stated), 0.01)
                << "roughness " << r / 10.0 << " cosine " << cosine;
            const float total = stated + diffuse_albedo(b, cosine).r;
            EXPECT_NEAR(total, 1.0f, 1e-4f);
        }
    }
}

TEST(Bsdf, ReflectionAndTransmissionTogetherStayWithinOne)
{
    for (const float roughness : {0.0f, 0.3f, 0.7f, 1.0f}) {
        for (const float cosine : kCosines) {
            const Bsdf b = coated(0.0f, std::sqrt(0.05f), 1.0f, pane(roughness, glm::vec3(0.8f)));
            glm::dvec3 sum(0.0);
            constexpr int kCount = 128;
            for_each_sample(kCount, [&](float choice, glm::vec2 u) {
                sum += glm::dvec3(sample(b, direction(cosine), choice, u).weight) / double(kCount * kCount);
            });
            EXPECT_LE(sum.r, 1.01) << roughness << " " << cosine;
            EXPECT_GE(sum.r, 0.98) << roughness << " " << cosine;
        }
    }
}

struct Case {
    std::string name;
    Bsdf bsdf;
};
std::vector<Case> cases()
{
    return {{"mirror", metal(0.0f)},
            {"narrow metal", metal(0.15f, {0.9f, 0.6f, 0.3f})},
            {"rough metal", metal(1.0f)},
            {"plastic", plastic(0.4f, {0.8f, 0.5f, 0.2f})},
            {"coated", coated(0.6f, 0.1f)},
            {"sharp coat", coated(0.3f, 0.0f)},
            {"pane", pane(0.0f)},
            {"frosted pane", pane(0.5f)},
            {"brushed", brushed(0.3f, 0.7f)},
            {"velvet", sheen(0.3f)},
            {"cloth", sheen(0.8f, {0.9f, 0.5f, 0.1f}, plastic(0.6f))}};
}

TEST(Bsdf, MeanWeightIsTheAlbedo)
{
    for (const auto& [name, b] : cases()) {
        for (const float cosine : {0.05f, 0.3f, 0.8f}) {
            glm::dvec3 all(0.0), glossy(0.0);
            constexpr int kCount = 256;
            for_each_sample(kCount, [&, &b = b](float choice, glm::vec2 u) {
                all += glm::dvec3(sample(b, direction(cosine), choice, u).weight) / double(kCount * kCount);
                glossy += glm::dvec3(sample_glossy(b, direction(cosine), choice, u).weight) / double(kCount * kCount);
            });
            // No coated surface here transmits.
            const glm::vec3 left = 1.0f - specular_albedo(b, cosine);
            const glm::vec3 through = left * lobe_of<Transmission>(b).color;
            const glm::vec3 expected = specular_albedo(b, cosine) + through;
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(glossy[c], expected[c], 0.012) << name << " " << cosine;
                EXPECT_NEAR(all[c], expected[c] + diffuse_albedo(b, cosine)[c], 0.012) << name << " " << cosine;
            }
        }
    }
}

/// The share of samples in each cell of a (cosine, azimuth) grid against the integral of the density there.
void expect_density(const Case& c, float cosine, bool glossy)
{
    constexpr int kRows = 12, kColumns = 12, kFine = 40, kCount = 300;
    const glm::vec3 o = direction(cosine, 0.2f);
    std::array<double, kRows * kColumns> found{}, expected{};
    const auto cell = [](glm::vec3 w) {
        const double row = (static_cast<double>(w.z) + 1.0) / 2.0 * kRows;
        const double column =
            (std::atan2(static_cast<double>(w.y), static_cast<double>(w.x)) / (2.0 * kPi) + 0.5) * kColumns;
        return std::min(static_cast<int>(row), kRows - 1) * kColumns + std::min(static_cast<int>(column), kColumns - 1);
    };
    double lost = 0.0;
    for_each_sample(kCount, [&](float choice, glm::vec2 u) {
        const BsdfSample s = glossy ? sample_glossy(c.bsdf, o, choice, u) : sample(c.bsdf, o, choice, u);
        if (s.density <= 0.0f) {
            lost += 1.0 / (kCount * kCount);
            return;
        }
        const float again = glossy ? glossy_density(c.bsdf, o, s.incoming) : density(c.bsdf, o, s.incoming);
        EXPECT_NEAR(again, s.density, 1e-4f * s.density) << c.name;
        found[static_cast<std::size_t>(cell(s.incoming))] += 1.0 / (kCount * kCount);
    });
    double total = 0.0;
    for (int row = 0; row < kRows * kFine; ++row) {
        for (int column = 0; column < kColumns * kFine; ++column) {
            const double z = -1.0 + 2.0 * (row + 0.5) / (kRows * kFine);
            const double phi = 2.0 * kPi * ((column + 0.5) / (kColumns * kFine) - 0.5);
            const glm::vec3 w = direction(static_cast<float>(z), static_cast<float>(phi));
            const double d = static_cast<double>(glossy ? glossy_density(c.bsdf, o, w) : density(c.bsdf, o, w)) * 4.0 *
                             kPi / (kRows * kFine * kColumns * kFine);
            expected[static_cast<std::size_t>((row / kFine) * kColumns + column / kFine)] += d;
            total += d;
        }
    }
    EXPECT_NEAR(total, 1.0 - lost, 0.01) << c.name << " cosine " << cosine;
    for (std::size_t i = 0; i < found.size(); ++i)
        EXPECT_NEAR(found[i], expected[i], 0.003 + 0.05 * expected[i])
            << c.name << " cell " << i << " cosine " << cosine;
}

TEST(Bsdf, SamplesFollowTheDensity)
{
    for (const Case& c : {Case{"metal", metal(0.6f)},
                          {"rough", metal(1.0f)},
                          {"plastic", plastic(0.7f)},
                          {"coated", coated(0.9f, 0.5f)},
                          {"frosted pane", pane(0.6f)},
                          {"leaf", leaf({0.6f, 0.4f, 0.2f}, {0.1f, 0.5f, 0.3f})},
                          {"brushed", brushed(0.5f, 0.8f)},
                          {"narrow sheen", sheen(0.1f)},
                          {"velvet", sheen(0.5f, {0.9f, 0.5f, 0.1f}, plastic(0.7f))}}) {
        for (const float cosine : {0.1f, 0.7f}) {
            expect_density(c, cosine, true);
            expect_density(c, cosine, false);
        }
    }
}

TEST(Bsdf, TheSingleScatteringLobeIsReciprocal)
{
    RandomStream random(3);
    for (int n = 0; n < 2000; ++n) {
        const Bsdf b = metal(random.next(), {0.9f, 0.5f, 0.1f});
        const glm::vec3 o = direction(0.01f + 0.99f * random.next(), 6.28f * random.next());
        const glm::vec3 i = direction(0.01f + 0.99f * random.next(), 6.28f * random.next());
        // The documented compensation depends on the viewer's angle; without it the two directions may change places.
        const auto single = [&](glm::vec3 from, glm::vec3 to) {
            const GgxAlbedo e = ggx_albedo(from.z, b.lobe[0].alpha);
            return evaluate(b, from, to) / (1.0f + b.lobe[0].color * (1.0f - e.scale - e.bias) / (e.scale + e.bias));
        };
        const glm::vec3 there = single(o, i), back = single(i, o);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(there[c], back[c], 1e-4f * there[c] + 1e-9f);
    }
}

TEST(Bsdf, AMirrorReflectsWithinAThousandthOfARadian)
{
    const Bsdf b = metal(0.0f);
    for (const float cosine : {0.1f, 0.5f, 1.0f}) {
        const glm::vec3 o = direction(cosine);
        const glm::vec3 mirrored(-o.x, -o.y, o.z);
        int close = 0;
        for_each_sample(64, [&](float choice, glm::vec2 u) {
            const BsdfSample s = sample_glossy(b, o, choice, u);
            close += glm::length(s.incoming - mirrored) < 0.02f;
            EXPECT_NEAR(s.weight.r, 1.0f, 0.05f);
        });
        EXPECT_GT(close, 64 * 64 * 98 / 100);
        // D at its peak is 1 / (pi alpha^2): no rounding of the half vector may flatten it.
        const double peak = 1.0 / (kPi * 1e-6) / (4.0 * static_cast<double>(cosine) * static_cast<double>(cosine));
        EXPECT_NEAR(evaluate_glossy(b, o, mirrored).r / peak, 1.0, 0.01);
    }
}

TEST(Bsdf, StaysFiniteAndPositiveAtTheEdges)
{
    const std::vector<glm::vec3> directions{
        {0, 0, 1},  {1, 0, 0},        direction(1e-7f), direction(1e-4f),
        {0, 0, -1}, direction(-0.3f), {-1, 0, 0},       {0.7071068f, 0, 0.7071068f}};
    for (auto [name, b] : cases()) {
        for (const glm::vec3 tilt : {glm::vec3(0, 0, 1), glm::normalize(glm::vec3(0.9f, 0.1f, 0.4f))}) {
            b.normal = tilt;
            for (const glm::vec3 o : directions) {
                for (const glm::vec3 i : directions) {
                    const glm::vec3 f = evaluate(b, o, i);
                    const float d = density(b, o, i);
                    EXPECT_TRUE(std::isfinite(f.r + f.g + f.b + d)) << name;
                    EXPECT_TRUE(f.r >= 0 && f.g >= 0 && f.b >= 0 && d >= 0) << name;
                }
                for (const float u : {0.0f, 0.5f, 0x1.fffffep-1f}) {
                    for (const float v : {0.0f, 0.5f, 0x1.fffffep-1f}) {
                        const BsdfSample s = sample(b, o, u, {v, u});
                        EXPECT_TRUE(std::isfinite(s.weight.r + s.density + s.incoming.x)) << name;
                        EXPECT_TRUE(s.weight.r >= 0 && s.weight.g >= 0 && s.weight.b >= 0 && s.density >= 0);
                        EXPECT_LT(s.weight.r, 20.0f) << name;
                    }
                }
                EXPECT_TRUE(std::isfinite(diffuse_albedo(b, glm::dot(o, tilt)).r)) << name;
            }
        }
    }
}

TEST(Bsdf, LightFromBelowEitherHorizonDoesNotCount)
{
    Bsdf b = plastic(0.5f);
    b.normal = glm::normalize(glm::vec3(0.5f, 0.0f, 1.0f));
    const glm::vec3 below_shading = glm::normalize(glm::vec3(-1.0f, 0.0f, 0.2f));
    const glm::vec3 below_face = glm::normalize(glm::vec3(1.0f, 0.0f, -0.1f));
    EXPECT_EQ(evaluate(b, {0, 0, 1}, below_shading), glm::vec3(0.0f));
    EXPECT_EQ(evaluate(b, {0, 0, 1}, below_face), glm::vec3(0.0f));
    EXPECT_NE(evaluate(b, {0, 0, 1}, {0, 0, 1}), glm::vec3(0.0f));
}

TEST(Bsdf, WithoutLobesItIsLambertian)
{
    const Bsdf b = surface_of({make_lobe<Diffuse>({0.5f, 0.25f, 0.125f})});
    for (const float cosine : kCosines) {
        EXPECT_EQ(diffuse_albedo(b, cosine), b.lobe[0].color);
        EXPECT_EQ(specular_albedo(b, cosine), glm::vec3(0.0f));
        EXPECT_NEAR(evaluate(b, direction(cosine), {0, 0, 1}).r, 0.5 / kPi, 1e-6);
        EXPECT_EQ(evaluate_glossy(b, direction(cosine), {0, 0, 1}), glm::vec3(0.0f));
        EXPECT_EQ(sample_glossy(b, direction(cosine), 0.5f, {0.5f, 0.5f}).weight, glm::vec3(0.0f));
        EXPECT_NEAR(sample(b, direction(cosine), 0.5f, {0.5f, 0.5f}).weight.g, 0.25f, 1e-6f);
    }
}

TEST(Bsdf, APaneSendsLightStraightOn)
{
    const Bsdf b = pane(0.0f);
    const glm::vec3 o = direction(0.6f);
    int through = 0;
    for_each_sample(64, [&](float choice, glm::vec2 u) {
        const BsdfSample s = sample_glossy(b, o, choice, u);
        if (s.incoming.z >= 0.0f) return;
        ++through;
        EXPECT_LT(glm::length(s.incoming + o), 0.2f);
    });
    EXPECT_GT(through, 64 * 64 / 2);
}

/// Looked at once or for each direction anew: the lobes are the same.
TEST(SeenLobes, ScatterAsTheirSurfaceDoes)
{
    for (const Bsdf& b : {metal(0.3f), plastic(0.5f), coated(0.4f, 0.1f), pane(0.2f), sheen(0.6f), brushed(0.3f, 0.8f),
                          leaf({0.3f, 0.6f, 0.2f}, {0.4f, 0.5f, 0.1f})}) {
        for (const float cosine : kCosines) {
            const glm::vec3 outgoing = direction(cosine, 1.1f);
            for (const LobeSet set : {kAllLobes, reflecting_lobes(b), diffuse_lobes(b)}) {
                const SeenLobes seen(b, outgoing, set);
                for_each_sample(4, [&](float choice, glm::vec2 u) {
                    const BsdfSample own = seen.sample(choice, u);
                    const float as_drawn = rcs::density(b, outgoing, own.incoming, set);
                    EXPECT_NEAR(own.density, own.density > 0.0f ? as_drawn : 0.0f, 1e-4f * as_drawn);
                    const glm::vec3 incoming = direction(u.x, 6.0f * u.y);
                    const glm::vec3 f = evaluate(b, outgoing, incoming, set), found = seen.evaluate(incoming);
                    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], f[c], 1e-5f * f[c]);
                    const float density = rcs::density(b, outgoing, incoming, set);
                    EXPECT_NEAR(seen.density(incoming), density, 1e-5f * density);
                });
            }
        }
    }
}

/// Bit for bit, whatever other lanes hold.
TEST(SeenLobes, LanesScatterAsSingleDirectionsDo)
{
    for (const Bsdf& b : {metal(0.3f), metal(kLeastAlpha), plastic(0.5f), coated(0.4f, 0.1f), pane(0.2f), sheen(0.6f),
                          brushed(0.3f, 0.8f), leaf({0.3f, 0.6f, 0.2f}, {0.4f, 0.5f, 0.1f})}) {
        for (const float cosine : kCosines) {
            const glm::vec3 outgoing = direction(cosine, 1.1f);
            for (const LobeSet set : {kAllLobes, reflecting_lobes(b), diffuse_lobes(b)}) {
                const SeenLobes seen(b, outgoing, set);
                DirectionLanes incoming;
                incoming.set(0, {0.0f, 0.0f, 0.0f});
                incoming.set(1, -outgoing);
                for (std::size_t i = 2; i < DirectionLanes::kWidth; ++i) {
                    const auto n = static_cast<float>(i);
                    incoming.set(i, direction(std::cos(0.23f * n), 1.9f * n));
                }
                const ColorLanes f = seen.evaluate(incoming);
                for (std::size_t i = 0; i < DirectionLanes::kWidth; ++i)
                    EXPECT_EQ(f[i], seen.evaluate(incoming[i])) << "lane " << i << ", cosine " << cosine;
            }
        }
    }
}

}  // namespace
}  // namespace rcs::test
