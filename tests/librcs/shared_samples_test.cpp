#include "compose/shared_samples.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/render.h"
#include "support/effect_scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

struct Both {
    RenderResult planned, everywhere;
};

/// With anti-aliasing where it shows, and everywhere.
Both render_both(const Scene& scene, RenderOptions options = {})
{
    options.width = options.height = 120;
    RenderOptions all = options;
    all.effects.with.set(Effect::anti_aliasing);
    return {test::render_first(scene, options), test::render_first(scene, all)};
}

/// Differences of pixels as parts of their light, largest first.
std::vector<double> differences(const Both& both)
{
    const std::vector<float>&a = both.planned.image.layers.at("beauty").pixels,
          &b = both.everywhere.image.layers.at("beauty").pixels;
    std::vector<double> result;
    for (std::size_t i = 0; i < a.size(); ++i)
        result.push_back(a[i] != b[i] ? static_cast<double>(std::abs(a[i] - b[i]) / b[i]) : 0.0);
    std::sort(result.rbegin(), result.rend());
    return result;
}

/// Within the stated bound, but for a few pixels: passes that see less also bring fewer records, which tell on their
/// surroundings, and so on what is taken of gathers where surfaces meet. How many these are is a draw of the seed
/// (33 to 216 values of 57,600 in a penumbra), so the median of five says it.
void expect_within_bound(const Scene& scene)
{
    std::vector<double> but_few, worst;
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
        RenderOptions options;
        options.seed = seed;
        const std::vector<double> sorted = differences(render_both(scene, options));
        but_few.push_back(sorted[sorted.size() / 500]);
        worst.push_back(sorted.front());
    }
    const auto median = [](std::vector<double>& values) {
        std::nth_element(values.begin(), values.begin() + 2, values.end());
        return values[2];
    };
    EXPECT_LE(median(but_few), kSmooth);
    EXPECT_LE(median(worst), 5.0 * kSmooth);
}

TEST(SharedSamples, AreMostOfASmoothRoomAndWithinTheStatedBound)
{
    const Scene scene = test::lit_room();
    const Both both = render_both(scene);
    const RenderStats& s = both.planned.stats;
    EXPECT_GT(s.counts.shared_samples, 3u * 120u * 120u * 6u / 10u);
    EXPECT_EQ(both.everywhere.stats.counts.shared_samples, 0u);
    EXPECT_EQ(s.plan[Effect::anti_aliasing].loss, kSmooth);
    expect_within_bound(scene);
    EXPECT_LT(s.counts.punctual_rays, both.everywhere.stats.counts.punctual_rays / 2);
}

/// Bars a fifth of a pixel wide, which the first sample of most pixels misses.
TEST(SharedSamples, MissNoShape)
{
    Scene scene = test::lit_room();
    const int black = test::add_material(scene, glm::vec3(0.0f));
    for (int bar = 0; bar < 40; ++bar)
        test::add_mesh(scene, test::quad({-0.5f + 0.025f * static_cast<float>(bar), 0.5f, 0.5f}, {0.003f, 0, 0},
                                         {0.2f, 1.5f, 0}, black));
    const Both both = render_both(scene);
    EXPECT_GT(both.planned.stats.counts.shared_samples, 10000u);
    expect_within_bound(scene);
}

TEST(SharedSamples, AreNoneInPenumbrasOfALamp)
{
    Scene scene = test::room(0.5f);
    const int lamp = test::add_material(scene, glm::vec3(0.0f), glm::vec3(20.0f));
    test::add_mesh(scene, test::quad({-0.5f, 2.9f, -0.5f}, {1.0f, 0, 0}, {0, 0, 1.0f}, lamp));
    test::add_mesh(scene, test::box({-0.6f, 1.0f, -0.6f}, {0.3f, 1.2f, 0.3f}, 0, test::Facing::outwards));
    const Both both = render_both(scene);
    EXPECT_GT(both.planned.stats.counts.shared_samples, 5000u);
    expect_within_bound(scene);
}

TEST(SharedSamples, AreNotForGoalsNorWhereRaysFollowLobes)
{
    RenderOptions goal;
    goal.quality = TargetError{0.2};
    EXPECT_EQ(render_both(test::lit_room(), goal).planned.stats.counts.shared_samples, 0u);
    EXPECT_EQ(render_both(test::panel_room(test::metal(0.1f))).planned.stats.counts.shared_samples, 0u);
    RenderOptions one;
    one.aa = 1;
    EXPECT_EQ(render_both(test::lit_room(), one).planned.stats.counts.shared_samples, 0u);
}

}  // namespace
}  // namespace rcs
