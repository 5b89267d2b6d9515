#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/records.h"
#include "stability/polished_ceiling.h"
#include "support/floor_points.h"
#include "support/scenes.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<Record> gather(const Scene& scene, const GBuffer& points, const RecordSettings& options,
                           RecordStats* stats = nullptr, int threads = 2)
{
    ThreadPool pool(threads);
    const RayScene rays = build_ray_scene(scene, pool);
    std::vector<std::uint32_t> pixels(points.size());
    std::iota(pixels.begin(), pixels.end(), 0u);
    RecordStats ignored;
    return gather_records(rays, points, pixels, options, pool, stats ? *stats : ignored);
}

/// Points along the lit corner's floor, all at distance d from the wall.
GBuffer points_beside_wall(double d, int count)
{
    std::vector<glm::vec2> points;
    for (int i = 0; i < count; ++i)
        points.emplace_back(static_cast<float>(d), 0.37f * static_cast<float>(i - count / 2));
    return test::points_on_floor(points);
}

TEST(GatherRecords, UnderAnOpenSkySeePiTimesItsRadiance)
{
    Scene scene;
    test::add_mesh(scene,
                   test::quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, test::add_material(scene, glm::vec3(0.5f))));
    scene.sky_radiance = {1.0f, 2.0f, 0.5f};
    for (const int bounces : {0, 1}) {
        RecordSettings options;
        options.bounces = bounces;
        for (const Record& r : gather(scene, test::points_on_floor({{0, 0}, {3, -4}}), options)) {
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(r.irradiance[c], kPi * static_cast<double>(scene.sky_radiance[c]), 1e-5);
            EXPECT_TRUE(std::isinf(r.harmonic_mean_distance));
            EXPECT_TRUE(std::isinf(r.minimum_distance));
            EXPECT_EQ(r.normal, glm::vec3(0, 1, 0));
            for (const glm::vec3 g : r.translation_gradient) EXPECT_EQ(g, glm::vec3(0.0f));
            EXPECT_NEAR(r.noise, 0.0f, 1e-5f);
        }
    }
}

TEST(GatherRecords, BesideALitWallHaveItsIrradianceAndTheGradientTowardsIt)
{
    const Scene scene = test::lit_corner();
    RecordSettings options;
    options.rays = 4096;
    const double h = 2.0;
    for (const double d : {0.3, 1.0, 3.0}) {
        const int count = 64;
        glm::dvec3 gradient(0.0);
        double irradiance = 0.0, noise = 0.0;
        for (const Record& r : gather(scene, points_beside_wall(d, count), options)) {
            irradiance += static_cast<double>(r.irradiance.g) / count;
            gradient += glm::dvec3(r.translation_gradient[1]) / static_cast<double>(count);
            noise += static_cast<double>(r.noise) / count;
        }
        const double expected = test::wall_irradiance(d, h);
        EXPECT_NEAR(irradiance, expected, 0.005 * expected) << d;
        // 64 records of 4096 rays; the cell form itself is 5 % short where the wall's top edge crosses wide cells.
        const double slope = -0.5 * kPi * h * h / std::pow(d * d + h * h, 1.5);
        EXPECT_NEAR(gradient.x, slope, 0.08 * std::abs(slope)) << d;
        EXPECT_NEAR(gradient.z, 0.0, 0.05 * std::abs(slope)) << d;
        EXPECT_NEAR(gradient.y, 0.0, 1e-5) << "in the tangent plane";
        EXPECT_GT(noise, 0.0);
        EXPECT_LT(noise, 0.1);
    }
}

TEST(GatherRecords, BesideALitWallGainAsTheNormalTurnsTowardsIt)
{
    const Scene scene = test::lit_corner();
    const double d = 1.0, h = 2.0;
    // E = pi/2 integral of sin(elevation + lean) from the floor to the wall's top; its derivative at no lean.
    const double expected = 0.5 * kPi * h / std::hypot(d, h);
    for (const int rays : {256, 4096}) {
        RecordSettings options;
        options.rays = rays;
        glm::dvec3 rotation(0.0);
        const int count = 256;
        for (const Record& r : gather(scene, points_beside_wall(d, count), options))
            rotation += glm::dvec3(r.rotation_gradient[1]) / static_cast<double>(count);
        // A normal that leans towards the wall at -x turns about +z.
        EXPECT_NEAR(rotation.z, expected, 0.03 * expected) << rays;
        EXPECT_NEAR(rotation.x, 0.0, 0.03 * expected) << rays;
        EXPECT_NEAR(rotation.y, 0.0, 1e-5) << rays;
    }
}

TEST(GatherRecords, BelowAGlossyCeilingHaveTheLightOfItsLobe)
{
    const float roughness = 0.35f;
    RecordSettings options;
    options.rays = 16384;
    const std::vector<float> places = {0.0f, 1.0f, 2.0f, 2.5f};
    std::vector<glm::vec2> points;
    for (const float x : places) points.emplace_back(x, 0.0f);
    const std::vector<Record> records =
        gather(test::polished_ceiling(roughness), test::points_on_floor(points), options);
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double expected = test::below_polished_ceiling(static_cast<double>(places[i]), roughness);
        EXPECT_NEAR(static_cast<double>(records[i].irradiance.g), expected, 0.02 * expected) << places[i];
    }
}

// What the lobe shows goes along the ceiling with who sees it: by the walls between cells alone, which stay where they
// are on the ceiling, the gradient is 1.7 times as steep.
TEST(GatherRecords, BelowAGlossyCeilingHaveTheGradientOfItsLobe)
{
    const float roughness = 0.55f;
    const Scene scene = test::polished_ceiling(roughness);
    RecordSettings options;
    options.rays = 4096;
    for (const double x : {0.5, 1.0, 1.5, 2.0}) {
        const int count = 32;
        std::vector<glm::vec2> points;
        for (int i = 0; i < count; ++i) points.emplace_back(static_cast<float>(x), 1e-3f * static_cast<float>(i));
        glm::dvec3 gradient(0.0);
        for (const Record& r : gather(scene, test::points_on_floor(points), options))
            gradient += glm::dvec3(r.translation_gradient[1]) / static_cast<double>(count);
        const double h = 0.1;
        const double expected =
            (test::below_polished_ceiling(x + h, roughness) - test::below_polished_ceiling(x - h, roughness)) /
            (2.0 * h);
        EXPECT_NEAR(gradient.x, expected, 0.05 * std::abs(expected)) << x;
        EXPECT_NEAR(gradient.z, 0.0, 0.05 * std::abs(expected)) << x;
        EXPECT_NEAR(gradient.y, 0.0, 1e-5) << x;
    }
}

TEST(GatherRecords, HaveTheHarmonicMeanOfTheDistancesTheyMeet)
{
    // In a sphere of radius 2 seen from a point at distance a of its centre, every chord is known.
    const Scene scene = test::lit_sphere(0.6f);
    GBuffer points = test::points_on_floor({{0.0f, 0.0f}, {1.0f, 0.0f}});
    RecordSettings options;
    options.rays = 4096;
    const std::vector<Record> records = gather(scene, points, options);
    EXPECT_NEAR(records[0].harmonic_mean_distance, 2.0f, 0.005f);
    EXPECT_NEAR(records[0].minimum_distance, 2.0f, 0.01f);
    double inverse = 0.0;
    const int n = 500;
    for (int j = 0; j < n; ++j) {
        const double sin_theta = std::sqrt((j + 0.5) / n);
        for (int k = 0; k < n; ++k) {
            const double along = sin_theta * std::cos(2.0 * kPi * (k + 0.5) / n);  // of the direction with x
            inverse += 1.0 / (std::sqrt(4.0 - 1.0 + along * along) - along) / (n * n);
        }
    }
    EXPECT_NEAR(records[1].harmonic_mean_distance, 1.0 / inverse, 0.005 / inverse);
}

TEST(GatherRecords, ComeInTheOrderOfThePixelsWhateverTheBatchOrTheThreads)
{
    const Scene scene = test::furnished_room();
    ThreadPool pool(3);
    const RayScene rays = build_ray_scene(scene, pool);
    std::vector<glm::vec2> xz;
    for (int i = 0; i < 200; ++i) xz.emplace_back(-1.9f + 0.019f * static_cast<float>(i), 1.0f);
    const GBuffer points = test::points_on_floor(xz);
    const std::vector<Record> whole = gather(scene, points, {}, nullptr, 1);
    RecordStats stats;
    const std::vector<Record> some = gather_records(rays, points, {150, 3, 77}, {}, pool, stats);
    ASSERT_EQ(some.size(), 3u);
    for (const auto& [k, pixel] : {std::pair<std::size_t, std::size_t>{0, 150}, {1, 3}, {2, 77}}) {
        EXPECT_EQ(std::memcmp(&some[k], &whole[pixel], sizeof(Record)), 0) << pixel;
    }
    EXPECT_EQ(stats.records, 3u);
    EXPECT_TRUE(gather_records(rays, points, {}, {}, pool, stats).empty());
}

TEST(GatherRecords, OfSeveralBouncesTakeALightCache)
{
    RecordSettings options;
    options.bounces = 2;
    EXPECT_THROW(gather(test::furnished_room(), test::points_on_floor({{0.0f, 1.0f}}), options), Error);
}

TEST(GatherRecords, ScaleWithTheLight)
{
    Scene scene = test::furnished_room();
    const GBuffer points = test::points_on_floor({{-1.5f, 1.0f}, {1.0f, 1.0f}, {0.5f, -1.0f}});
    const std::vector<Record> once = gather(scene, points, {});
    for (Material& m : scene.materials) m.emission *= 4.0f;
    for (PunctualLight& l : scene.lights) l.intensity *= 4.0f;
    const std::vector<Record> four = gather(scene, points, {});
    for (std::size_t k = 0; k < once.size(); ++k) {
        EXPECT_NEAR(four[k].irradiance.r, 4.0f * once[k].irradiance.r, 1e-5f * four[k].irradiance.r);
        EXPECT_NEAR(four[k].noise, once[k].noise, 1e-4f);
        EXPECT_EQ(four[k].harmonic_mean_distance, once[k].harmonic_mean_distance);
    }
}

}  // namespace
}  // namespace rcs
