#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "cells/light_cache_impl.h"
#include "light_cache/bounces.h"
#include "rcs/error.h"
#include "rcs/light_cache.h"
#include "support/floor_points.h"
#include "support/scenes.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

/// A cache for the scene's camera, its cells found from points on a floor at y = 0.
struct Built {
    LightCacheStats stats;
    LightCache cache;

    Built(const Scene& scene, int bounces, const std::vector<glm::vec2>& floor, int threads = 2, int max_cells = 80'000)
        : cache(build(scene, bounces, floor, threads, max_cells))
    {
    }

    LightCache build(const Scene& scene, int bounces, const std::vector<glm::vec2>& floor, int threads, int max_cells)
    {
        ThreadPool pool(threads);
        const RayScene rays = build_ray_scene(scene, pool);
        return build_light_cache(rays, test::points_on_floor(floor), test::view_of(scene.cameras[0], 100, 100),
                                 {.bounces = bounces, .max_cells = max_cells}, pool, stats);
    }

    /// Mean over lookups near one place.
    glm::dvec3 at(glm::vec3 position, glm::vec3 normal) const
    {
        RandomStream random(7);
        glm::dvec3 sum(0.0);
        const int n = 256;
        for (int i = 0; i < n; ++i) sum += glm::dvec3(cached_irradiance(cache, position, normal, random));
        return sum / static_cast<double>(n);
    }
};

std::vector<glm::vec2> floor_grid(float half_width, int side)
{
    std::vector<glm::vec2> points;
    for (int i = 0; i < side * side; ++i)
        points.emplace_back(
            half_width * (2.0f * (static_cast<float>(i % side) + 0.5f) / static_cast<float>(side) - 1.0f),
            half_width * (2.0f * (static_cast<float>(i / side) + 0.5f) / static_cast<float>(side) - 1.0f));
    return points;
}

/// A closed sphere with a lamp in the middle: after n reflections E_n = I / r^2 (rho + ... + rho^n).
TEST(LightCache, OfALitSphereHasTheGeometricSeriesOfEachBounce)
{
    for (const double rho : {0.3, 0.8, 0.95}) {
        const Scene scene = test::lit_sphere(static_cast<float>(rho));
        for (const int bounces : {1, 2, 3, 7, 63}) {
            const Built built(scene, bounces, floor_grid(0.9f, 8));
            const double expected = 0.25 * rho * (1.0 - std::pow(rho, bounces)) / (1.0 - rho);
            const glm::dvec3 e = built.at({0.0f, -2.0f, 0.0f}, {0.0f, 1.0f, 0.0f});
            EXPECT_NEAR(e.g, expected, 0.005 * expected) << rho << ' ' << bounces;
        }
    }
}

/// A loop of links that gives everything back: nothing may be gained.
TEST(LightCache, BouncesOfAWhiteFurnaceNeitherGainNorLose)
{
    BounceSystem system;
    const std::size_t leaves = 1000;
    system.resize_leaves(leaves);
    system.cells = leaves + 1;
    for (std::size_t c = 0; c < leaves; ++c) {
        system.source[c] = glm::vec3(c == 0 ? 1000.0f : 0.0f);
        system.parents.push_back({static_cast<std::uint32_t>(c), BounceSystem::kTop});
        for (std::size_t i = 0; i < CellRays::kRays; ++i) {
            Link& link = system.links[c * CellRays::kRays + i];
            link = make_link(true, glm::vec3(1.0f));
            // Each cell is seen by as many as it sees, so the sum over cells is kept.
            link.cell = static_cast<std::uint32_t>((c + 37 * i + 1) % leaves);
        }
    }
    ThreadPool pool(2);
    for (const int bounces : {1, 2, 8, 64}) {
        std::vector<glm::vec3> e(system.cells);
        std::vector<std::vector<glm::vec3>> fewer(2);
        iterate_bounces(system, bounces, pool, e, fewer);
        // The mean source is 1, and every bounce brings as much again.
        EXPECT_NEAR(e.back().r, static_cast<float>(bounces), 1e-3f * static_cast<float>(bounces)) << bounces;
        for (int k = 1; k <= 2 && k < bounces; ++k)
            EXPECT_NEAR(fewer[static_cast<std::size_t>(k - 1)].back().r, static_cast<float>(bounces - k),
                        1e-3f * static_cast<float>(bounces));
    }
}

TEST(LightCache, StopsWhenBouncesBringNothingNew)
{
    BounceSystem system;
    system.resize_leaves(1);
    system.cells = 2;
    system.source[0] = glm::vec3(1.0f);
    system.parents.push_back({0u, BounceSystem::kTop});
    for (std::size_t i = 0; i < CellRays::kRays; ++i) {
        system.links[i] = make_link(true, glm::vec3(0.5f));
        system.links[i].cell = 0;
    }
    ThreadPool pool(1);
    std::vector<glm::vec3> few(2), many(2);
    std::vector<std::vector<glm::vec3>> none;
    iterate_bounces(system, 20, pool, few, none);
    iterate_bounces(system, 1'000'000'000, pool, many, none);
    EXPECT_EQ(few[0].r, many[0].r);
    EXPECT_NEAR(many[0].r, 2.0f, 1e-4f);
}

/// The corner's wall reflects radiance 1 (its irradiance is 2 pi); the floor beside it gets Lambert's share of that.
TEST(LightCache, OfACornerHasLambertsIrradianceOnTheFloor)
{
    const Scene scene = test::lit_corner();
    const Built built(scene, 1, {{0.5f, 0.0f}, {1.0f, 0.3f}, {1.5f, -0.3f}, {0.2f, 0.7f}, {0.4f, -0.8f}, {1.8f, 0.1f}});
    // The points themselves see no floor; the wall they see does.
    for (const float d : {0.3f, 1.0f, 2.0f}) {
        double mean = 0.0, expected = 0.0;
        const int n = 40;  // along the wall, to average over the noise of single cells
        for (int i = 0; i < n; ++i) {
            const float z = 0.05f * static_cast<float>(i - n / 2);
            mean += built.at({d, 0.0f, z}, {0.0f, 1.0f, 0.0f}).g / n;
            expected += test::wall_irradiance(static_cast<double>(d), 2.0) / n;
        }
        EXPECT_NEAR(mean, expected, 0.06 * expected) << d;
    }
}

TEST(LightCache, WithTooManyCellsTakesCoarserOnes)
{
    const double rho = 0.8, expected = 0.25 * (rho + rho * rho + rho * rho * rho);
    for (const int most : {1, 100, 1000}) {
        const Built built(test::lit_sphere(0.8f), 3, floor_grid(0.9f, 12), 2, most);
        // The least there can be: the six sectors of normals in each cube of the coarsest level.
        EXPECT_LE(built.stats.cells, static_cast<std::uint64_t>(std::max(2 * most, 6 * 8 * 2)));
        EXPECT_NEAR(built.at({0.0f, -2.0f, 0.0f}, {0.0f, 1.0f, 0.0f}).g, expected, 0.01 * expected) << most;
    }
}

TEST(LightCache, IsTheSameForAnyNumberOfThreads)
{
    const Scene scene = test::furnished_room();
    const Built one(scene, 3, floor_grid(1.9f, 20), 1);
    const Built three(scene, 3, floor_grid(1.9f, 20), 3);
    const std::vector<glm::vec3>& a = one.cache.impl().irradiance;
    const std::vector<glm::vec3>& b = three.cache.impl().irradiance;
    ASSERT_EQ(a.size(), b.size());
    EXPECT_GT(one.stats.cells, 500u);
    EXPECT_EQ(one.stats.links, three.stats.links);
    EXPECT_EQ(one.stats.shadow_rays, three.stats.shadow_rays);
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(glm::vec3)), 0);
}

TEST(LightCache, IsEmptyWhereThereIsNothingToSee)
{
    Scene empty;
    empty.cameras = {look_at_camera("camera", {0, 0, 3}, {0, 0, 0}, 0.8)};
    GBuffer nothing = test::points_on_floor({{0, 0}, {1, 0}});
    nothing.instance.assign(2, GBuffer::kNone);
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(empty, pool);
    LightCacheStats stats;
    const LightCache cache =
        build_light_cache(rays, nothing, test::view_of(empty.cameras[0], 2, 1), {.bounces = 4}, pool, stats);
    EXPECT_EQ(stats.cells, 0u);
    RandomStream random(1);
    EXPECT_EQ(cached_irradiance(cache, {1, 2, 3}, {0, 1, 0}, random), glm::vec3(0.0f));
}

TEST(LightCache, OfALoneTriangleIsDark)
{
    Scene scene;
    Mesh mesh;
    mesh.positions = {{-1, 0, -1}, {0, 0, 1}, {1, 0, -1}};
    mesh.triangles = {{0, 1, 2}};
    mesh.material = test::add_material(scene, glm::vec3(0.9f));
    test::add_mesh(scene, mesh);
    scene.sky_radiance = glm::vec3(1.0f);
    scene.cameras = {look_at_camera("camera", {0, 3, 0.1}, {0, 0, 0}, 0.8)};
    const Built built(scene, 8, {{0.0f, 0.0f}, {0.1f, 0.2f}});
    EXPECT_EQ(built.stats.links, 0u);
    EXPECT_EQ(built.at({0, 0, 0}, {0, 1, 0}).g, 0.0);
}

TEST(LightCache, SaysWhichNumberOfBouncesItTakes)
{
    for (const int bounces : {0, 65}) {
        try {
            validate(LightCacheSettings{.bounces = bounces});
            FAIL() << bounces;
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            EXPECT_NE(std::string(e.what()).find("light_cache.bounces is " + std::to_string(bounces)),
                      std::string::npos);
        }
    }
}

TEST(CellGrid, PutsNearPlacesOfOneOrientationIntoOneCellAndOthersNot)
{
    const Scene scene = test::emissive_box(0.5f, 1.0f);
    const CellGrid grid = make_cell_grid(bounds_of(scene), test::view_of(scene.cameras[0], 100, 100));
    const glm::vec3 p(0.31f, -0.42f, -0.77f), up(0, 1, 0);
    const int level = grid.level(p);
    const float edge = grid.edge(level);
    EXPECT_EQ(grid.leaf(p, up, level), grid.leaf(p, glm::normalize(glm::vec3(0.1f, 1.0f, -0.1f)), level));
    EXPECT_NE(grid.leaf(p, up, level), grid.leaf(p, -up, level));
    EXPECT_NE(grid.leaf(p, up, level), grid.leaf(p, {1, 0, 0}, level));
    EXPECT_NE(grid.leaf(p, up, level), grid.leaf(p + glm::vec3(1.01f * edge, 0, 0), up, level));
    EXPECT_NE(grid.leaf(p, up, level), grid.leaf(p, up, level + 1));
}

TEST(CellGrid, HasOneParentForTheEightCubesInIt)
{
    const Scene scene = test::emissive_box(0.5f, 1.0f);
    const CellGrid grid = make_cell_grid(bounds_of(scene), test::view_of(scene.cameras[0], 100, 100));
    RandomStream random(3);
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 p(random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.5f);
        const glm::vec3 n = glm::normalize(glm::vec3(random.next() - 0.5f, random.next() - 0.5f, random.next() - 0.5f));
        const int level = static_cast<int>(6.0f * random.next()) + 2;
        const std::uint64_t leaf = grid.leaf(p, n, level);
        EXPECT_EQ(CellGrid::level_of(CellGrid::parent(leaf)), static_cast<std::uint64_t>(level + 1));
        // Two levels up from the finer cell is one level up from it.
        EXPECT_EQ(CellGrid::parent(CellGrid::parent(grid.leaf(p, n, level - 1))), CellGrid::parent(leaf));
    }
}

TEST(CellGrid, ScalesWithTheScene)
{
    for (const double scale : {1e-3, 1e3}) {
        const Bounds one{glm::dvec3(-1.0), glm::dvec3(2.0)}, other{glm::dvec3(-scale), glm::dvec3(2.0 * scale)};
        const CellGrid a =
            make_cell_grid(one, test::view_of(look_at_camera("", {0.3, 0.2, 0.1}, {1, 1, 1}, 0.9), 10, 10));
        const CellGrid b = make_cell_grid(
            other,
            test::view_of(look_at_camera("", glm::dvec3(0.3, 0.2, 0.1) * scale, glm::dvec3(scale), 0.9), 10, 10));
        int same = 0;
        RandomStream random(5);
        for (int i = 0; i < 1000; ++i) {
            const glm::vec3 p(3.0f * random.next() - 1.0f, 3.0f * random.next() - 1.0f, 3.0f * random.next() - 1.0f);
            const glm::vec3 q = static_cast<float>(scale) * p;
            same += a.leaf(p, {0, 0, 1}, a.level(p)) == b.leaf(q, {0, 0, 1}, b.level(q));
        }
        EXPECT_GT(same, 950) << "but for what rounding puts across an edge";
    }
}

}  // namespace
}  // namespace rcs
