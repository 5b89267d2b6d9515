// What rays along narrow lobes find is shared between neighbours: soft light where mirrors show it, and cells of direct
// light where lobes are wide.
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "glossy/traced_lobes.h"
#include "light_cache/direct_cells.h"
#include "lit_points/lamp_guide.h"
#include "records/lamps_to_gather.h"
#include "support/effect_scenes.h"
#include "support/seen_place.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kSize = 96;

/// A room lit by a huge panel through a window, seen in metal of that roughness before its back wall.
Scene room_in_metal(float roughness)
{
    Scene scene = test::window_room(1.0f);
    test::add_mesh(scene, test::quad({-1.9f, 0.1f, -1.98f}, {3.8f, 0, 0}, {0, 2.8f, 0},
                                     test::add_surface(scene, test::metal(roughness))));
    return scene;
}

struct Place : test::SeenPlace {
    GatheredLamps gathered;
    LampGuide guide;

    explicit Place(Scene s)
        : SeenPlace(std::move(s), kSize),
          gathered(lamps_to_gather({rays}, points, {}, pool)),
          guide(rays, effects, gathered, points, view, 1, pool)
    {
        gathered.finder = &guide;
    }

    HitRadiance light() const { return {rays, nullptr, effects, &gathered}; }
    DirectCells cells() { return light_cells(rays, light(), points, view, 4e6, 1, pool); }

    TracedLight trace(LobeSettings settings, GlossyStats& stats, ThreadPool& threads) const
    {
        settings.gathered = &gathered;
        return trace_lobes(rays, light(), points, view, shading, settings, threads, stats);
    }
    TracedLight trace(const LobeSettings& settings)
    {
        GlossyStats stats;
        return trace(settings, stats, pool);
    }
    bool is_traced(std::size_t pixel) const { return points.covered(pixel) && shading.is_traced(pixel); }
};

double light_of(const TracedLight& traced, std::size_t pixel)
{
    return static_cast<double>(luminance(traced.radiance[pixel]));
}

TEST(LobeSharing, AMirrorsPixelsShareTheSoftLightThatTheyShow)
{
    Place place(room_in_metal(0.0f));
    ASSERT_TRUE(place.gathered.any());
    const TracedLight truth = place.trace({.rays_per_pixel = 1024, .seed = 7});
    const TracedLight traced = place.trace({.rays_per_pixel = 16, .seed = 1, .checked = 3});
    double shared = 0.0, own = 0.0;
    int count = 0;
    for (const TracedAgain& again : traced.again) {
        if (again.pixel == GBuffer::kNone) continue;
        ++count;
        const double light = light_of(truth, again.pixel);
        shared += std::abs(light_of(traced, again.pixel) - light);
        own += std::abs(static_cast<double>(luminance(again.radiance[0])) - light);
    }
    ASSERT_GT(count, 50);
    EXPECT_LT(shared, 0.6 * own);
}

TEST(LobeSharing, BringsTheSameLight)
{
    Place place(room_in_metal(0.0f));
    const auto mean = [&](int rays, std::uint64_t seed) {
        const TracedLight traced = place.trace({.rays_per_pixel = rays, .seed = seed});
        double sum = 0.0;
        for (std::size_t i = 0; i < traced.radiance.size(); ++i) sum += light_of(traced, i);
        return sum;
    };
    constexpr int kSeeds = 12;
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) sum += mean(16, seed) / kSeeds;
    EXPECT_NEAR(sum / mean(1024, 77), 1.0, 0.01);
}

/// Metal whose normals lean from its face, below a sky that is the same all over: some of a lobe looks into the metal.
Scene bent_metal(float turn)
{
    Scene scene = test::window_room(1.0f);
    scene.meshes.clear(), scene.instances.clear(), scene.lights.clear();
    scene.sky_radiance = glm::vec3(1.0f);
    Mesh wall = test::quad({-3, -3, -2}, {6, 0, 0}, {0, 6, 0}, test::add_surface(scene, test::metal(0.35f)));
    wall.normals.assign(wall.positions.size(), glm::vec3(std::sin(turn), 0.0f, std::cos(turn)));
    test::add_mesh(scene, wall);
    scene.cameras = {look_at_camera("camera", {-2.0, 0.0, -1.0}, {0.5, 0.0, -2.0}, 0.6)};
    return scene;
}

TEST(LobeSharing, LosesWhatLooksBelowTheFace)
{
    for (const float turn : {0.0f, 0.1f, 0.2f}) {
        test::SeenPlace place(bent_metal(turn), kSize);
        double shared = 0.0, own = 0.0;
        int count = 0;
        for (std::uint64_t seed = 1; seed <= 4; ++seed) {
            GlossyStats stats;
            const TracedLight traced = trace_lobes(
                place.rays, HitRadiance(place.rays, nullptr, place.effects, nullptr), place.points, place.view,
                place.shading, {.rays_per_pixel = 16, .seed = seed, .checked = 3}, place.pool, stats);
            for (const TracedAgain& again : traced.again) {
                if (again.pixel == GBuffer::kNone) continue;
                ++count;
                shared += light_of(traced, again.pixel);
                for (const glm::vec3& radiance : again.radiance) own += 0.5 * static_cast<double>(luminance(radiance));
            }
        }
        ASSERT_GT(count, 400);
        EXPECT_NEAR(shared / own, 1.0, 0.015) << turn;
    }
}

TEST(LobeSharing, TheErrorOfSharedLightIsKnown)
{
    Place place(room_in_metal(0.0f));
    const TracedLight truth = place.trace({.rays_per_pixel = 1024, .seed = 7});
    const TracedLight traced = place.trace({.rays_per_pixel = 16, .seed = 1});
    double told = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < traced.radiance.size(); ++i) {
        if (!place.is_traced(i)) continue;
        told += std::pow(static_cast<double>(traced.error[i]), 2.0);
        squares += std::pow(light_of(traced, i) - light_of(truth, i), 2.0);
    }
    EXPECT_GT(told, 0.0);
    EXPECT_NEAR(std::sqrt(told / squares), 1.0, 0.5);
}

TEST(LobeSharing, GivesTheSameBitsForAnyNumberOfThreads)
{
    const Place place(room_in_metal(0.0f));
    ThreadPool one(1), three(3);
    GlossyStats stats;
    EXPECT_EQ(place.trace({.seed = 5}, stats, one).radiance, place.trace({.seed = 5}, stats, three).radiance);
}

TEST(LobeSharing, WideLobesTakeTheLightOfCells)
{
    Place place(room_in_metal(0.5f));
    const DirectCells cells = place.cells();
    constexpr int kSeeds = 8;
    double scatter[2] = {}, mean[2] = {};
    std::uint64_t shadow_rays[2] = {};
    for (const bool known : {false, true}) {
        std::vector<double> sums(place.points.size()), squares(place.points.size());
        for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
            GlossyStats stats;
            const TracedLight traced =
                place.trace({.seed = seed, .direct = known ? &cells : nullptr}, stats, place.pool);
            shadow_rays[known] += stats.shadow_rays;
            for (std::size_t i = 0; i < sums.size(); ++i) {
                sums[i] += light_of(traced, i) / kSeeds;
                squares[i] += light_of(traced, i) * light_of(traced, i) / kSeeds;
            }
        }
        for (std::size_t i = 0; i < sums.size(); ++i) {
            mean[known] += sums[i];
            scatter[known] += squares[i] - sums[i] * sums[i];
        }
    }
    EXPECT_NEAR(mean[1] / mean[0], 1.0, 0.03);
    EXPECT_LT(scatter[1], 0.7 * scatter[0]);
    EXPECT_LT(shadow_rays[1], shadow_rays[0] / 2);
}

TEST(LobeSharing, MirrorsShowMoreThanCells)
{
    Place place(room_in_metal(0.0f));
    const DirectCells cells = place.cells();
    EXPECT_EQ(place.trace({.direct = &cells}).radiance, place.trace({}).radiance);
}

}  // namespace
}  // namespace rcs
