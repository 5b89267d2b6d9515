// Narrow lobes look at lit points: the light is that of their rays alone, with less noise, where a lit spot is hard to
// find.
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "facts/scene_effects.h"
#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "glossy/lobe_trial.h"
#include "glossy/traced_lobes.h"
#include "records/guided_gathers.h"
#include "support/effect_scenes.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

class Floor {
public:
    static constexpr int kSize = 64;

    explicit Floor(const Scene& s)
        : scene(s),
          rays(build_ray_scene(scene, pool)),
          view(make_views(scene.cameras[0], kSize, kSize, 1)[0]),
          effects(scene_effects(rays)),
          gbuffer(render_gbuffer(test::shared_gl(), rays, view, 1.0f, pool, effects, shading))
    {
        look_around(1);
    }

    /// Other lit points for each seed.
    void look_around(std::uint64_t seed)
    {
        RecordSettings settings;
        settings.seed = seed;
        guide = search_light({rays}, gbuffer, view, settings, true, pool).guide;
        if (guide) learn_along_lobes(rays, light(), gbuffer, view, shading, seed, pool, *guide);
    }

    HitRadiance light() const { return {rays, nullptr, effects}; }

    TracedLight trace(int rays_per_pixel, int looks, std::uint64_t seed, ThreadPool& threads)
    {
        LobeSettings settings;
        settings.rays_per_pixel = rays_per_pixel;
        settings.looks_per_pixel = looks;
        settings.guide = guide.get();
        settings.seed = seed;
        GlossyStats stats;
        TracedLight traced = trace_lobes(rays, light(), gbuffer, view, shading, settings, threads, stats);
        EXPECT_EQ(stats.looks > 0, looks > 0);
        return traced;
    }

    ThreadPool pool{2};
    Scene scene;
    RayScene rays;
    View view;
    EffectSet effects;
    Shading shading;
    GBuffer gbuffer;
    std::unique_ptr<GatherGuide> guide;
};

double mean(const TracedLight& light)
{
    return std::accumulate(light.radiance.begin(), light.radiance.end(), 0.0, [&](double sum, glm::vec3 r) {
        return sum + static_cast<double>(luminance(r)) / static_cast<double>(light.radiance.size());
    });
}

class LobesLook : public testing::TestWithParam<float> {};

TEST_P(LobesLook, ForTheLightOfRaysAlone)
{
    Floor floor(test::screened_room(GetParam()));
    constexpr int kSeeds = 16;
    double by_rays = 0.0, by_both = 0.0, squares = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        floor.look_around(seed);
        ASSERT_NE(floor.guide, nullptr);
        by_rays += mean(floor.trace(64, 0, seed, floor.pool)) / kSeeds;
        const double both = mean(floor.trace(16, 4, seed, floor.pool));
        by_both += both / kSeeds;
        squares += both * both / kSeeds;
    }
    const double unsure = std::sqrt((squares - by_both * by_both) / kSeeds);
    EXPECT_NEAR(by_both / by_rays, 1.0, 0.01 + 3.0 * unsure / by_both);
    EXPECT_LT(unsure, 0.015 * by_both);
}

INSTANTIATE_TEST_SUITE_P(Roughness, LobesLook, testing::Values(0.3f, 0.45f));

TEST(LobesLook, GiveTheSameBitsForAnyNumberOfThreads)
{
    Floor floor(test::screened_room(0.35f));
    ASSERT_NE(floor.guide, nullptr);
    ThreadPool one(1), three(3);
    EXPECT_EQ(floor.trace(8, 4, 5, one).radiance, floor.trace(8, 4, 5, three).radiance);
}

TEST(LobesLook, WhereItHelps)
{
    const auto looks_of = [](Floor& floor) {
        LobeSettings settings;
        settings.guide = floor.guide.get();
        return worthwhile_looks(floor.rays, floor.light(), floor.gbuffer, floor.view, floor.shading, settings,
                                floor.pool)
            .count;
    };
    Floor rough(test::screened_room(0.4f)), mirror(test::screened_room(0.02f));
    EXPECT_GT(looks_of(rough), 0);
    EXPECT_EQ(looks_of(mirror), 0);
}

// The next pixel's lobe shows something else: what its looks find by a rare chance is no guess at this one's.
TEST(LobesLook, ForNeighboursWhoseLobesOverlap)
{
    Scene scene = test::screened_room(0.02f);
    const glm::vec3 centre(-0.5f, 0.6f, 0.3f);
    const float radius = 0.5f;
    test::add_mesh(scene, test::icosphere(centre, radius, 5, test::add_surface(scene, test::metal(0.25f))));
    Floor ball(scene);
    ASSERT_NE(ball.guide, nullptr);
    constexpr int kSeeds = 12;
    std::vector<double> sum(ball.gbuffer.size()), squares(ball.gbuffer.size());
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const TracedLight found = ball.trace(16, 4, seed, ball.pool);
        for (std::size_t i = 0; i < sum.size(); ++i) {
            const auto light = static_cast<double>(luminance(found.radiance[i]));
            sum[i] += light / kSeeds, squares[i] += light * light / kSeeds;
        }
    }
    double variance = 0.0, square = 0.0;
    int pixels = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        if (!(sum[i] > 0.0) || glm::length(ball.gbuffer.scene_position(i) - centre) > 1.01f * radius) continue;
        ++pixels, variance += squares[i] - sum[i] * sum[i], square += sum[i] * sum[i];
    }
    ASSERT_GT(pixels, 200);
    // .14; if all share with all that lie near on the ball, .38.
    EXPECT_LT(std::sqrt(variance / square), 0.25);
}

TEST(LobesLook, ErrorsOfLooksArePartOfTheEstimate)
{
    Floor floor(test::screened_room(0.4f));
    const TracedLight truth = floor.trace(1024, 0, 99, floor.pool), found = floor.trace(16, 4, 1, floor.pool);
    double off = 0.0, told = 0.0;
    for (std::size_t i = 0; i < found.radiance.size(); ++i) {
        off += static_cast<double>(std::abs(luminance(found.radiance[i] - truth.radiance[i])));
        told += 0.8 * static_cast<double>(found.error[i]);
    }
    EXPECT_GT(told, 0.6 * off);
    EXPECT_LT(told, 1.7 * off);
}

}  // namespace
}  // namespace rcs
