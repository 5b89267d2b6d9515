#include "compose/lamp_checks.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "facts/scene_effects.h"
#include "gbuffer/visible_points.h"
#include "lit_points/lamp_guide.h"
#include "records/lamps_to_gather.h"
#include "support/effect_scenes.h"
#include "support/place.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

/// A room behind windows, before which a huge lamp stands, and who finds it.
struct Room : test::Place {
    GatheredLamps lamps;
    EffectSet effects;
    LampGuide guide;

    Room()
        : test::Place(test::window_room(1.0f), test::even_floor()),
          lamps(lamps_to_gather(LitScene{rays}, points, RecordSettings{}, pool)),
          effects(scene_effects(rays)),
          guide(rays, effects, lamps, points, view, 1, pool)
    {
        lamps.finder = &guide;
    }

    HitRadiance light() const { return {rays, nullptr, effects, &lamps}; }

    /// Luminance of irradiance.
    double truth(std::size_t i) const
    {
        const HitRadiance plain(rays, nullptr, effects);
        constexpr int kCount = 8192;
        double sum = 0.0;
        for (int k = 0; k < kCount; ++k) {
            RandomStream random(stream_key(7, Stream::gather, i << 20 | static_cast<std::uint64_t>(k)));
            plain.direct(visible_point(points, i), random, [&](const Ray& ray, glm::vec3 white) {
                if (!occluded(rays, ray)) sum += M_PI * static_cast<double>(luminance(white)) / kCount;
            });
        }
        return sum;
    }

    /// Sums of records that all say `light`, give or take `scatter`.
    SplatBuffer records(float light, float scatter, float weight) const
    {
        SplatBuffer sums;
        sums.width = points.width, sums.height = points.height;
        sums.weighted_r = sums.weighted_g = sums.weighted_b = std::vector<float>(points.size(), weight * light);
        sums.weight.assign(points.size(), weight);
        sums.luminance_unit = 2.0f;
        sums.variance.assign(points.size(), 0.0f);
        sums.variance_of_sum = sums.variance;
        sums.squares.assign(points.size(), weight * (light * light + scatter * scatter) / 4.0f);
        return sums;
    }
};

double light_at(const SplatBuffer& sums, std::size_t i)
{
    return static_cast<double>(luminance({sums.weighted_r[i], sums.weighted_g[i], sums.weighted_b[i]}) /
                               sums.weight[i]);
}

TEST(LampChecks, FindWhatPixelsSeeWhereRecordsDisagree)
{
    Room room;
    ASSERT_TRUE(room.lamps.any());
    std::vector<double> truth;
    double mean = 0.0;
    for (std::size_t i = 0; i < room.points.size(); ++i) {
        truth.push_back(room.truth(i));
        mean += truth.back() / static_cast<double>(room.points.size());
    }
    ASSERT_GT(mean, 0.0);
    const auto wrong = static_cast<float>(2.0 * mean);
    SplatBuffer of_lamps = room.records(wrong, wrong, 3.0f), all = room.records(wrong + 1.0f, wrong, 3.0f);
    const LampChecks checks = check_lamps(room.rays, room.light(), room.points, room.view, 1, room.pool, of_lamps, all);
    EXPECT_EQ(checks.pixels, room.points.size());
    EXPECT_GT(checks.shadow_rays, 16u * checks.pixels);
    double before = 0.0, after = 0.0, found = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        before += std::abs(static_cast<double>(wrong) - truth[i]);
        after += std::abs(light_at(of_lamps, i) - truth[i]);
        found += light_at(of_lamps, i) / static_cast<double>(truth.size());
        EXPECT_NEAR(light_at(all, i), light_at(of_lamps, i) + 1.0, 1e-4) << "light of others stays";
    }
    // Alone, without what pixels around found, they come to .19 of it.
    EXPECT_LT(after, 0.16 * before);
    EXPECT_NEAR(found, mean, 0.1 * mean);
}

TEST(LampChecks, LeaveWhatRecordsAgreeOn)
{
    Room room;
    SplatBuffer of_lamps = room.records(1.0f, 0.3f, 2.0f), all = room.records(3.0f, 0.3f, 2.0f);
    const SplatBuffer before = of_lamps, all_before = all;
    const LampChecks checks = check_lamps(room.rays, room.light(), room.points, room.view, 1, room.pool, of_lamps, all);
    EXPECT_EQ(checks.pixels, 0u);
    EXPECT_EQ(of_lamps.weighted_g, before.weighted_g);
    EXPECT_EQ(all.weighted_g, all_before.weighted_g);
}

TEST(LampChecks, LeaveWhatIsNoise)
{
    Room room;
    SplatBuffer of_lamps = room.records(1.0f, 1.0f, 2.0f), all = of_lamps;
    of_lamps.variance.assign(room.points.size(), 2.0f / 4.0f);
    EXPECT_EQ(check_lamps(room.rays, room.light(), room.points, room.view, 1, room.pool, of_lamps, all).pixels, 0u);
}

TEST(LampChecks, DoNotDependOnThreads)
{
    Room room;
    SplatBuffer one = room.records(1.0f, 1.0f, 2.0f), three = one, all = room.records(3.0f, 1.0f, 2.0f), all3 = all;
    ThreadPool alone(1), pool(3);
    check_lamps(room.rays, room.light(), room.points, room.view, 1, alone, one, all);
    check_lamps(room.rays, room.light(), room.points, room.view, 1, pool, three, all3);
    EXPECT_EQ(one.weighted_r, three.weighted_r);
    EXPECT_EQ(all.weighted_b, all3.weighted_b);
}

/// A lamp that sends no more than a record says may be hidden: glossy light of records goes with it.
TEST(LampChecks, LobesSeeAsMuchLess)
{
    Room room;
    SplatBuffer of_lamps = room.records(100.0f, 100.0f, 1.0f), all = of_lamps;
    of_lamps.glossy_r = of_lamps.glossy_g = of_lamps.glossy_b = std::vector<float>(room.points.size(), 10.0f);
    all.glossy_r = all.glossy_g = all.glossy_b = std::vector<float>(room.points.size(), 15.0f);
    check_lamps(room.rays, room.light(), room.points, room.view, 1, room.pool, of_lamps, all);
    for (std::size_t i = 0; i < room.points.size(); ++i) {
        EXPECT_NEAR(of_lamps.glossy_g[i], 10.0f * of_lamps.weighted_g[i] / 100.0f, 1e-3f);
        EXPECT_NEAR(all.glossy_g[i] - of_lamps.glossy_g[i], 5.0f, 1e-3f);
    }
}

}  // namespace
}  // namespace rcs
