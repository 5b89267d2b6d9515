#include "lamps/polygon.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "support/scenes.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

float factor(const std::vector<glm::vec3>& corners, glm::vec3 normal)
{
    return polygon_irradiance_factor(corners.data(), static_cast<int>(corners.size()), normal);
}

struct Random {
    RandomStream stream;
    explicit Random(std::uint64_t seed) : stream(mix64(seed)) {}
    float in(float low, float high) { return low + (high - low) * stream.next(); }
    glm::vec3 direction()
    {
        const float z = in(-1.0f, 1.0f);
        const float phi = in(0.0f, 2.0f * std::numbers::pi_v<float>);
        const float r = std::sqrt(1.0f - z * z);
        return {r * std::cos(phi), r * std::sin(phi), z};
    }
    glm::vec3 point() { return {in(-1.0f, 1.0f), in(-1.0f, 1.0f), in(-1.0f, 1.0f)}; }
};

/// Irradiance from a triangle by area integration on a fine grid, in double: independent of Lambert's
/// formula. Midpoint rule over n^2 small triangles of equal area.
double integrated_factor(const glm::vec3 (&c)[3], glm::vec3 normal, int n)
{
    const glm::dvec3 a(c[0]), u = glm::dvec3(c[1]) - a, v = glm::dvec3(c[2]) - a;
    const glm::dvec3 twice_area = glm::cross(u, v);
    double sum = 0;
    const auto add = [&](double i, double j) {
        const glm::dvec3 p = a + (i / n) * u + (j / n) * v;
        const double d2 = glm::dot(p, p);
        sum += std::max(0.0, glm::dot(p, glm::dvec3(normal))) * std::abs(glm::dot(p, twice_area)) / (d2 * d2);
    };
    for (int i = 0; i < n; ++i) {
        for (int j = 0; i + j < n; ++j) {
            add(i + 1.0 / 3, j + 1.0 / 3);
            if (i + j + 1 < n) add(i + 2.0 / 3, j + 2.0 / 3);
        }
    }
    return 0.5 * sum / n / n;
}

TEST(PolygonIrradiance, OfAParallelSquareEqualsTheClosedForm)
{
    for (const float x : {0.0f, 0.3f, 1.0f, 2.5f}) {
        for (const float h : {0.05f, 1.0f, 7.0f}) {
            const std::vector<glm::vec3> square = {{-1 - x, -1, h}, {1 - x, -1, h}, {1 - x, 1, h}, {-1 - x, 1, h}};
            const double expected = test::rectangle_irradiance(-1 - x, 1 - x, -1, 1, h);
            // Float: a sum of four terms of up to pi, each good to about 2e-7.
            EXPECT_NEAR(factor(square, {0, 0, 1}), expected, 2e-6 + 1e-5 * expected) << x << ' ' << h;
        }
    }
}

TEST(PolygonIrradiance, EqualsAnAreaIntegralAlsoAcrossTheHorizon)
{
    Random random(1);
    int crossing = 0;
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 normal = random.direction();
        const glm::vec3 shift = 1.5f * random.direction();
        const glm::vec3 c[3] = {shift + 0.7f * random.point(), shift + 0.7f * random.point(),
                                shift + 0.7f * random.point()};
        const glm::vec3 n = glm::cross(c[1] - c[0], c[2] - c[0]);
        if (std::abs(glm::dot(glm::normalize(n), c[0])) < 0.2f) continue;  // there the midpoint rule is poor
        int above = 0;
        for (const glm::vec3 corner : c) above += glm::dot(corner, normal) > 0.0f ? 1 : 0;
        crossing += above == 1 || above == 2 ? 1 : 0;
        // Midpoint rule with 200^2 cells: curvature leaves about 1e-4, the kink at the horizon 1/200^2.
        EXPECT_NEAR(factor({c[0], c[1], c[2]}, normal), integrated_factor(c, normal, 200), 3e-4) << i;
    }
    EXPECT_GT(crossing, 15);
}

TEST(PolygonIrradiance, DoesNotDependOnWindingOrderOrScale)
{
    Random random(2);
    for (int i = 0; i < 100; ++i) {
        const glm::vec3 normal = random.direction();
        const glm::vec3 a = random.point(), b = random.point(), c = random.point();
        const float f = factor({a, b, c}, normal);
        EXPECT_NEAR(factor({c, b, a}, normal), f, 2e-6);
        EXPECT_NEAR(factor({b, c, a}, normal), f, 2e-6);
        for (const float scale : {1e-6f, 1e-3f, 1e4f})
            EXPECT_NEAR(factor({scale * a, scale * b, scale * c}, normal), f, 2e-6) << scale;
    }
}

TEST(PolygonIrradiance, OfBothHalvesAddsUpToTheWhole)
{
    Random random(3);
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 normal = random.direction();
        const glm::vec3 a = random.point(), b = random.point(), c = random.point();
        const glm::vec3 middle = glm::mix(a, b, random.in(0.0f, 1.0f));
        const float halves = factor({a, middle, c}, normal) + factor({middle, b, c}, normal);
        EXPECT_NEAR(halves, factor({a, b, c}, normal), 5e-6);
    }
}

TEST(PolygonIrradiance, OfAWallThatTouchesTheFloorTendsToHalfThatOfTheSky)
{
    for (const float d : {1e-2f, 1e-3f, 1e-4f, 1e-6f}) {
        const std::vector<glm::vec3> wall = {{d, -500, 0}, {d, 500, 0}, {d, 500, 1}, {d, -500, 1}};
        EXPECT_NEAR(factor(wall, {0, 0, 1}), test::wall_irradiance(d, 1.0), 1e-5) << d;
    }
}

TEST(PolygonIrradiance, OfASmallFarPolygonIsAreaTimesCosinesOverDistanceSquared)
{
    const glm::vec3 direction = glm::normalize(glm::vec3(1, 2, 3));
    for (const float distance : {10.0f, 1000.0f}) {
        const float s = 0.1f;
        const glm::vec3 centre = distance * direction;
        const std::vector<glm::vec3> square = {centre + glm::vec3(-s, -s, 0), centre + glm::vec3(s, -s, 0),
                                               centre + glm::vec3(s, s, 0), centre + glm::vec3(-s, s, 0)};
        const float cosine = direction.z;
        const float expected = 4 * s * s * cosine * cosine / (distance * distance);
        // The point approximation: (s/d)^2 = 1e-4; float: roundings of 1e-7 divided by s/d = 1e-4.
        EXPECT_NEAR(factor(square, {0, 0, 1}), expected, 2e-3f * expected) << distance;
    }
}

TEST(PolygonIrradiance, OfASquareSeenNearlyEdgeOnEqualsTheClosedForm)
{
    // What the edges add up to is less than 1e-7 of each.
    for (const float h : {0.002f, 0.01f, 0.05f}) {
        for (const float x : {1.5f, 3.0f, 8.0f}) {
            const std::vector<glm::vec3> square = {{-1 - x, -1, h}, {1 - x, -1, h}, {1 - x, 1, h}, {-1 - x, 1, h}};
            const double expected = test::rectangle_irradiance(-1 - x, 1 - x, -1, 1, h);
            EXPECT_NEAR(factor(square, {0, 0, 1}), expected, 1e-3 * expected) << x << ' ' << h;
        }
    }
}

TEST(PolygonIrradiance, IsZeroBelowTheHorizonAndForDegeneratePolygons)
{
    const glm::vec3 up(0, 0, 1);
    EXPECT_EQ(factor({{0, 0, -1}, {1, 0, -1}, {0, 1, -2}}, up), 0.0f);
    EXPECT_EQ(factor({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, up), 0.0f);
    EXPECT_NEAR(factor({{0, 0, 1}, {1, 0, 1}, {2, 0, 1}}, up), 0.0f, 1e-6f);
    EXPECT_NEAR(factor({{1, 0, 1}, {1, 0, 1}, {0, 1, 1}}, up), 0.0f, 1e-6f);
    EXPECT_NEAR(factor({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, up), 0.0f, 1e-6f);
}

TEST(PolygonIrradiance, IsFiniteAndBoundedWhereThePointTouchesThePolygon)
{
    Random random(4);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 a = random.point(), b = random.point(), c = random.point();
        const glm::vec3 points[] = {a, 0.5f * (a + b), (a + b + c) / 3.0f, a + 1e-7f * random.direction()};
        for (const glm::vec3 p : points) {
            const float f = factor({a - p, b - p, c - p}, random.direction());
            EXPECT_GE(f, 0.0f);
            EXPECT_LE(f, std::numbers::pi_v<float>);
        }
    }
}

TEST(SphericalTriangle, OfAnOctantHasTheSolidAngleOfAnOctant)
{
    const glm::vec3 corners[3] = {{3, 0, 0}, {0, 0.5f, 0}, {0, 0, 7}};
    EXPECT_NEAR(make_spherical_triangle(corners).solid_angle, 0.5 * kPi, 1e-12);
}

TEST(SphericalTriangle, HasTheSolidAngleOfGirardsTheorem)
{
    Random random(5);
    for (int i = 0; i < 500; ++i) {
        const glm::vec3 corners[3] = {random.point(), random.point(), random.point()};
        const glm::dvec3 a(corners[0]), b(corners[1]), c(corners[2]);
        const auto angle = [](glm::dvec3 at, glm::dvec3 p, glm::dvec3 q) {
            const glm::dvec3 side_p = glm::normalize(glm::cross(at, p));
            const glm::dvec3 side_q = glm::normalize(glm::cross(at, q));
            return std::acos(glm::clamp(glm::dot(side_p, side_q), -1.0, 1.0));
        };
        const double girard = angle(a, b, c) + angle(b, c, a) + angle(c, a, b) - kPi;
        // acos loses half the digits near 0 and pi.
        EXPECT_NEAR(make_spherical_triangle(corners).solid_angle, girard, 1e-6) << i;
    }
}

/// Moments of the direction over a triangle, by n x n uniformly spaced samples.
struct Moments {
    glm::dvec3 first{0.0};
    glm::dmat3 second{0.0};
    double weight = 0.0;
};
Moments sampled_moments(const SphericalTriangle& triangle, int n)
{
    Moments m;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            const TriangleSample s = sample(triangle, (static_cast<float>(i) + 0.5f) / static_cast<float>(n),
                                            (static_cast<float>(j) + 0.5f) / static_cast<float>(n));
            const glm::dvec3 w = glm::normalize(glm::dvec3(s.position));
            const double share = static_cast<double>(s.inverse_density) / n / n;
            m.weight += share;
            m.first += share * w;
            m.second += share * glm::outerProduct(w, w);
        }
    }
    return m;
}

TEST(SphericalTriangle, SamplesAreUniformInSolidAngleAlsoForSmallThinAndNearTriangles)
{
    // Against the same triangle sampled by area, which does not use the sphere.
    Random random(6);
    for (const float size : {1.0f, 0.1f, 1e-2f, 1e-4f}) {
        for (int i = 0; i < 30; ++i) {
            const glm::vec3 shift = random.direction();
            const glm::vec3 c[3] = {shift + size * random.point(), shift + size * random.point(),
                                    shift + size * random.point()};
            const SphericalTriangle triangle = make_spherical_triangle(c);
            if (triangle.solid_angle > 1.5) continue;  // so near that area samples converge too slowly
            SphericalTriangle by_area = triangle;
            by_area.by_area = true;
            const Moments uniform = sampled_moments(triangle, 64);
            const Moments expected = sampled_moments(by_area, 512);
            // Midpoint rule on 64^2 cells over a warped square: 1e-3 of the solid angle.
            const double tolerance = 2e-3 * triangle.solid_angle;
            EXPECT_NEAR(uniform.weight, triangle.solid_angle, 1e-6 * triangle.solid_angle);
            EXPECT_NEAR(expected.weight, triangle.solid_angle, tolerance);
            // Relative to the centre, spread shrinks with the size: so must the tolerance.
            const double radius = std::sqrt(triangle.solid_angle);
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(uniform.first[k], expected.first[k], tolerance) << size << ' ' << i;
                EXPECT_NEAR(uniform.first[k] / uniform.weight, expected.first[k] / expected.weight,
                            5e-3 * radius + 1e-6)
                    << size << ' ' << i;
                for (int l = 0; l < 3; ++l)
                    EXPECT_NEAR(uniform.second[k][l], expected.second[k][l], tolerance) << size << ' ' << i;
            }
        }
    }
}

TEST(SphericalTriangle, FirstMomentOfTheSamplesIsLambertsFormula)
{
    const glm::vec3 c[3] = {{1, 0.2f, 0.3f}, {-0.5f, 1, 0.2f}, {0.1f, -0.2f, 0.9f}};
    const Moments m = sampled_moments(make_spherical_triangle(c), 512);
    const glm::vec3 normals[] = {{0, 0, 1}, glm::normalize(glm::vec3(0.2f, 0.3f, 1))};
    for (const glm::vec3 n : normals)
        EXPECT_NEAR(glm::dot(m.first, glm::dvec3(n)), factor({c[0], c[1], c[2]}, n), 1e-4);
}

TEST(SphericalTriangle, SamplesLieOnTheTriangle)
{
    Random random(7);
    for (int i = 0; i < 2000; ++i) {
        const float size = std::pow(10.0f, random.in(-6.0f, 1.0f));
        const glm::vec3 shift = random.direction();
        const glm::vec3 c[3] = {shift + size * random.point(), shift + size * random.point(),
                                shift + size * random.point()};
        const SphericalTriangle triangle = make_spherical_triangle(c);
        const glm::dvec3 ab = triangle.corner[1] - triangle.corner[0];
        const glm::dvec3 ac = triangle.corner[2] - triangle.corner[0];
        for (int k = 0; k < 8; ++k) {
            const float u1 = k == 0 ? 0.0f : random.in(0, 1);
            const float u2 = k == 1 ? 0.0f : random.in(0, 1);
            const TriangleSample s = sample(triangle, u1, u2);
            ASSERT_TRUE(std::isfinite(s.inverse_density) && s.inverse_density >= 0.0f);
            const glm::dvec3 p = glm::dvec3(s.position) - triangle.corner[0];
            const double n2 = glm::dot(triangle.normal, triangle.normal);
            const double u = glm::dot(glm::cross(p, ac), triangle.normal) / n2;
            const double v = glm::dot(glm::cross(ab, p), triangle.normal) / n2;
            // The position is rounded to float: 1e-7 of the distance, against the triangle's heights.
            const double height = std::sqrt(n2) / std::max(glm::length(ab), glm::length(ac));
            const double tolerance = 1e-6 + 4e-7 * (1.0 + static_cast<double>(size)) / height;
            EXPECT_GT(u, -tolerance) << i;
            EXPECT_GT(v, -tolerance) << i;
            EXPECT_LT(u + v, 1.0 + 2 * tolerance) << i;
        }
    }
}

TEST(SphericalTriangle, DegenerateOnesYieldFiniteSamples)
{
    const glm::vec3 zero(0.0f);
    const glm::vec3 cases[][3] = {
        {zero, {1, 0, 0}, {0, 1, 0}},         {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}},
        {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}},
        {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}},    {{-1e3f, -1e3f, 1e-6f}, {1e3f, -1e3f, 1e-6f}, {0, 1e3f, 1e-6f}}};
    for (const auto& c : cases) {
        const SphericalTriangle triangle = make_spherical_triangle(c);
        for (float u = 0.0f; u < 1.0f; u += 0.124f) {
            for (float v = 0.0f; v < 1.0f; v += 0.124f) {
                const TriangleSample s = sample(triangle, u, v);
                EXPECT_TRUE(std::isfinite(s.inverse_density) && s.inverse_density >= 0.0f);
                EXPECT_TRUE(std::isfinite(glm::length(s.position)));
            }
        }
    }
}

/// Bit for bit, also of those that are sampled by area as a whole or at a corner.
TEST(SphericalTriangle, LanesAreSampledAsSinglePointsAre)
{
    const glm::vec3 cases[][3] = {
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},         {{-1, -1, 2}, {1, -1, 2}, {0, 1, 3}},
        {{1e-3f, 0, 5}, {0, 1e-3f, 5}, {0, 0, 5}}, {{1, 0, 1e-7f}, {-1, 0.1f, 0}, {0, 1, 0}},
        {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}},         {{-1e3f, -1e3f, 1e-6f}, {1e3f, -1e3f, 1e-6f}, {0, 1e3f, 1e-6f}}};
    for (const auto& c : cases) {
        const SphericalTriangle triangle = make_spherical_triangle(c);
        for (const std::size_t count : {std::size_t{1}, std::size_t{7}, TriangleLanes::kWidth}) {
            TriangleLanes lanes;
            for (std::size_t i = 0; i < count; ++i) {
                lanes.u1[i] = 0.061f * static_cast<float>(i);
                lanes.u2[i] = i == 3 ? 0.0f : 0.99f - 0.055f * static_cast<float>(i);
            }
            sample(triangle, count, lanes);
            for (std::size_t i = 0; i < count; ++i) {
                const TriangleSample one = sample(triangle, lanes.u1[i], lanes.u2[i]);
                EXPECT_EQ(lanes[i].position, one.position) << i;
                EXPECT_EQ(lanes[i].inverse_density, one.inverse_density) << i;
            }
        }
    }
}

}  // namespace
}  // namespace rcs
