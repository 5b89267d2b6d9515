#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "records/hemisphere.h"
#include "util/basis.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

/// Radiance and distance along a direction from a point: the scene of an analytic case.
struct Seen {
    double radiance = 0.0;
    double distance = std::numeric_limits<double>::infinity();
    glm::dvec3 plane{0.0};  ///< 1 / distance along w is dot(plane, w) for all of the surface that was hit
};
using World = std::function<Seen(glm::dvec3 origin, glm::dvec3 direction)>;

/// A bright rectangle 1.0 x 1.1 m, one metre above the plane z = 0, off centre.
Seen lit_rectangle(glm::dvec3 origin, glm::dvec3 direction)
{
    if (direction.z <= 0.0) return {};
    const double t = (1.0 - origin.z) / direction.z;
    const glm::dvec3 p = origin + t * direction;
    const bool inside = p.x > 0.1 && p.x < 1.1 && p.y > -0.4 && p.y < 0.7;
    return {inside ? 1.0 : 0.2 + 0.05 * std::sin(p.x), t, {0.0, 0.0, 1.0 / (1.0 - origin.z)}};
}

/// A wall of height 2 m and radiance 1 at x = 0.05 m beside the floor, without end along y.
Seen lit_wall(glm::dvec3 origin, glm::dvec3 direction)
{
    const double d = 0.05 - origin.x;
    if (direction.x <= 0.0) return {};
    const double t = d / direction.x;
    return t * direction.z < 2.0 ? Seen{1.0, t, {1.0 / d, 0.0, 0.0}} : Seen{};
}

/// Irradiance by brute force: a midpoint rule over the hemisphere in double precision.
double irradiance(const World& world, glm::dvec3 origin, glm::dvec3 normal)
{
    const Basis frame(glm::vec3(normal), 0.0f);
    const int rings = 700, azimuths = 1400;
    double sum = 0.0;
    for (int j = 0; j < rings; ++j) {
        const double sin2 = (j + 0.5) / rings;
        for (int k = 0; k < azimuths; ++k) {
            const double phi = 2.0 * kPi * (k + 0.5) / azimuths;
            const glm::dvec3 d =
                std::sqrt(sin2) * (std::cos(phi) * glm::dvec3(frame.x) + std::sin(phi) * glm::dvec3(frame.y)) +
                std::sqrt(1.0 - sin2) * glm::dvec3(frame.z);
            sum += world(origin, d).radiance;
        }
    }
    return kPi * sum / (rings * azimuths);
}

HemisphereIntegrals gather(const World& world, int rays, std::uint64_t seed, glm::vec3& rotation,
                           glm::vec3& translation)
{
    const HemisphereGrid grid = make_hemisphere_grid(rays);
    RandomStream random(seed);
    const Basis frame({0.0f, 0.0f, 1.0f}, random.next());
    const std::size_t n = static_cast<std::size_t>(grid.cells);
    std::vector<float> x(n), y(n), z(n);
    const float shift1 = random.next();
    hemisphere_directions(grid, {shift1, random.next()}, x.data(), y.data(), z.data());
    HemisphereSamples samples(grid.cells);
    for (std::size_t c = 0; c < n; ++c) {
        const glm::dvec3 d(x[c] * frame.x + y[c] * frame.y + z[c] * frame.z);
        const Seen seen = world(glm::dvec3(0.0), d);
        samples.red[c] = samples.green[c] = samples.blue[c] = static_cast<float>(seen.radiance);
        samples.inverse_distance[c] = static_cast<float>(1.0 / seen.distance);
        samples.cosine[c] = z[c];
        samples.plane_x[c] = static_cast<float>(glm::dot(seen.plane, glm::dvec3(frame.x)));
        samples.plane_y[c] = static_cast<float>(glm::dot(seen.plane, glm::dvec3(frame.y)));
        samples.plane_z[c] = static_cast<float>(glm::dot(seen.plane, glm::dvec3(frame.z)));
    }
    const HemisphereIntegrals result = integrate(grid, samples);
    const auto to_world = [&](glm::vec3 v) { return v.x * frame.x + v.y * frame.y + v.z * frame.z; };
    rotation = to_world(result.rotation_gradient[0]);
    translation = to_world(result.translation_gradient[0]);
    return result;
}

TEST(HemisphereDirections, AreUnitAndCosineDistributed)
{
    const HemisphereGrid grid = make_hemisphere_grid(1024);
    std::vector<float> x(static_cast<std::size_t>(grid.cells)), y(x), z(x);
    hemisphere_directions(grid, {0.3f, 0.9f}, x.data(), y.data(), z.data());
    double mean_z = 0.0, mean_x = 0.0, mean_xx = 0.0;
    for (std::size_t c = 0; c < x.size(); ++c) {
        EXPECT_NEAR(x[c] * x[c] + y[c] * y[c] + z[c] * z[c], 1.0f, 2e-6f);
        mean_z += z[c];
        mean_x += x[c];
        mean_xx += x[c] * x[c];
    }
    // Cosine-distributed: <cos> = 2/3, <x> = 0, <x^2> = 1/4; stratification leaves about 1/(M N).
    EXPECT_NEAR(mean_z / grid.cells, 2.0 / 3.0, 2e-3);
    EXPECT_NEAR(mean_x / grid.cells, 0.0, 3e-3);
    EXPECT_NEAR(mean_xx / grid.cells, 0.25, 2e-3);
}

TEST(HemisphereDirections, LieInTheirOwnCells)
{
    const HemisphereGrid grid = make_hemisphere_grid(200);
    std::vector<float> x(static_cast<std::size_t>(grid.cells)), y(x), z(x);
    hemisphere_directions(grid, {0.77f, 0.13f}, x.data(), y.data(), z.data());
    for (int c = 0; c < grid.cells; ++c) {
        const std::size_t i = static_cast<std::size_t>(c);
        const double sin2 = x[i] * x[i] + y[i] * y[i];
        double phi = std::atan2(y[i], x[i]);
        phi += phi < 0.0 ? 2.0 * kPi : 0.0;
        const double ring = sin2 * grid.rings, azimuth = phi / (2.0 * kPi) * grid.azimuths;
        EXPECT_GE(ring, c / grid.azimuths - 1e-4);
        EXPECT_LE(ring, c / grid.azimuths + 1 + 1e-4);
        EXPECT_GE(azimuth, c % grid.azimuths - 1e-3);
        EXPECT_LE(azimuth, c % grid.azimuths + 1 + 1e-3);
    }
}

TEST(HemisphereIntegrals, OfAConstantWorldAreExact)
{
    glm::vec3 rotation, translation;
    const auto constant = [](glm::dvec3, glm::dvec3) { return Seen{2.0, 3.0}; };
    const HemisphereIntegrals r = gather(constant, 256, 1, rotation, translation);
    EXPECT_NEAR(r.irradiance.r, 2.0 * kPi, 1e-5);
    EXPECT_NEAR(r.harmonic_mean_distance, 3.0f, 1e-5f);
    EXPECT_NEAR(r.minimum_distance, 3.0f, 1e-5f);
    EXPECT_NEAR(glm::length(translation), 0.0f, 1e-5f);
    // The tangent's sum over a full circle cancels to rounding.
    EXPECT_NEAR(glm::length(rotation), 0.0f, 1e-4f);
    EXPECT_NEAR(r.standard_error, 0.0f, 1e-6f);
}

TEST(HemisphereIntegrals, OfNothingHitAreFinite)
{
    glm::vec3 rotation, translation;
    const auto sky = [](glm::dvec3, glm::dvec3) { return Seen{1.0}; };
    const HemisphereIntegrals r = gather(sky, 64, 1, rotation, translation);
    EXPECT_NEAR(r.irradiance.g, kPi, 1e-5);
    EXPECT_TRUE(std::isinf(r.harmonic_mean_distance));
    EXPECT_EQ(glm::length(translation), 0.0f);
}

class Gradients : public ::testing::TestWithParam<int> {};

TEST_P(Gradients, AgreeWithFiniteDifferences)
{
    const double h = 0.02;
    const glm::dvec3 up(0.0, 0.0, 1.0);
    const double dx = (irradiance(lit_rectangle, {h, 0, 0}, up) - irradiance(lit_rectangle, {-h, 0, 0}, up)) / (2 * h);
    const double dy = (irradiance(lit_rectangle, {0, h, 0}, up) - irradiance(lit_rectangle, {0, -h, 0}, up)) / (2 * h);
    // Turning n by a small angle about axis a changes E by a.g angle, since n x n' = a sin(angle).
    const auto turned = [&](glm::dvec3 axis, double angle) {
        return irradiance(lit_rectangle, {}, std::cos(angle) * up + std::sin(angle) * glm::cross(axis, up));
    };
    const double rx = (turned({1, 0, 0}, h) - turned({1, 0, 0}, -h)) / (2 * h);
    const double ry = (turned({0, 1, 0}, h) - turned({0, 1, 0}, -h)) / (2 * h);

    glm::dvec3 mean_translation(0.0), mean_rotation(0.0);
    double mean_e = 0.0;
    const int runs = 200;
    for (int run = 0; run < runs; ++run) {
        glm::vec3 rotation, translation;
        mean_e += gather(lit_rectangle, GetParam(), static_cast<std::uint64_t>(run) * 7919, rotation, translation)
                      .irradiance.r;
        mean_translation += glm::dvec3(translation);
        mean_rotation += glm::dvec3(rotation);
    }
    mean_translation /= runs;
    mean_rotation /= runs;
    EXPECT_NEAR(mean_e / runs, irradiance(lit_rectangle, {}, up), 2e-3);
    EXPECT_NEAR(mean_rotation.x, rx, 0.02);
    EXPECT_NEAR(mean_rotation.y, ry, 0.02);
    // Walls between cells count with their exact extent, so what is left is the wall's position: 3 % at 256 rays.
    const double slack = 0.04 * std::hypot(dx, dy);
    EXPECT_NEAR(mean_translation.x, dx, slack);
    EXPECT_NEAR(mean_translation.y, dy, slack);
}
INSTANTIATE_TEST_SUITE_P(Rays, Gradients, ::testing::Values(256, 800, 3200));

TEST(Gradients, OfALongWallBesideTheRecordDoNotGrowWithItsNearness)
{
    // E(d) = pi/2 (1 - d / sqrt(d^2 + h^2)), so dE/dx = -dE/dd, about pi / (2 h) close to the wall.
    const double d = 0.05, h = 2.0;
    const double exact = 0.5 * kPi * h * h / std::pow(d * d + h * h, 1.5);
    glm::dvec3 mean(0.0);
    const int runs = 400;
    for (int run = 0; run < runs; ++run) {
        glm::vec3 rotation, translation;
        gather(lit_wall, 800, static_cast<std::uint64_t>(run) * 7919, rotation, translation);
        mean += glm::dvec3(translation) / static_cast<double>(runs);
    }
    // Strata of 7 degrees blur the wall's end at the horizon: what is left of a tenfold excess.
    EXPECT_NEAR(mean.x, exact, 0.5 * exact);
    EXPECT_NEAR(mean.y, 0.0, 0.1 * exact);
}

TEST(StandardError, IsAboutTheSpreadOfManyGathers)
{
    double sum = 0.0, squares = 0.0, estimated = 0.0;
    const int runs = 400;
    for (int run = 0; run < runs; ++run) {
        glm::vec3 rotation, translation;
        const HemisphereIntegrals r =
            gather(lit_rectangle, 256, static_cast<std::uint64_t>(run) * 104729, rotation, translation);
        sum += r.irradiance.r;
        squares += r.irradiance.r * r.irradiance.r;
        estimated += r.standard_error;
    }
    const double spread = std::sqrt(squares / runs - (sum / runs) * (sum / runs));
    // An upper estimate: neighbouring cells differ by more than the lattice's error inside them.
    EXPECT_GT(estimated / runs, 0.8 * spread);
    EXPECT_LT(estimated / runs, 6.0 * spread);
}

}  // namespace
}  // namespace rcs
