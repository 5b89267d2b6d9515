#include "direct/spared_pixels.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/effect_scenes.h"
#include "support/scenes.h"
#include "support/seen_place.h"
#include "util/color.h"

namespace rcs {
namespace {

/// A room with a lamp below its ceiling, and a panel below that.
Scene shadowed_room(double right)
{
    Scene scene = test::room(0.5f);
    const int black = test::add_material(scene, glm::vec3(0.0f), glm::vec3(0.0f), true);
    test::add_mesh(scene, test::quad({-1.0f, 2.9f, -1.5f}, {1.2f, 0, 0}, {0, 0, 1.2f},
                                     test::add_material(scene, glm::vec3(0.0f), glm::vec3(9.0f))));
    test::add_mesh(scene, test::quad({-1.0f, 1.9f, -1.9f}, {1, 0, 0}, {0, 0, 1.6f}, black));
    Camera& camera = scene.cameras[0];
    camera.world_from_view[3] += right * camera.world_from_view[0];
    return scene;
}

/// Light of a view, and what of it another one, a bit to the right, is spared.
struct Spared {
    test::SeenPlace before{shadowed_room(0.0), 96}, now{shadowed_room(0.02), 96};
    PastPoints points{points_of(before.points, before.view)};
    PastPlaces places{points, now.points, now.view, now.shading, now.pool};
    DirectSettings settings;
    std::uint64_t rays = 0;
    DirectLightResult light =
        direct_light(before.rays, before.points, before.view, before.shading, settings, before.pool, rays);
    std::vector<float> all;
    std::vector<DirectLight::Workspace> workspaces{2};

    Spared()
    {
        for (const glm::vec3& irradiance : light.irradiance) all.push_back(0.2f * luminance(irradiance) + 0.01f);
    }
    SparedPixels at(std::uint64_t turn)
    {
        const PastDirect past{places, light, all, 1e-3f, {}, turn, turn};
        return {&past, DirectLight(now.rays, settings), now.points, now.view, now.pool, workspaces};
    }
};

TEST(SparedPixels, TakeTurnsInBeingSampled)
{
    Spared spared;
    std::vector<int> sampled(spared.now.points.size(), 0);
    for (std::uint64_t turn = 5; turn < 21; ++turn) {
        const SparedPixels pixels = spared.at(turn);
        for (std::size_t i = 0; i < sampled.size(); ++i) sampled[i] += pixels.has(i) ? 0 : 1;
    }
    int in_turn = 0;
    for (std::size_t i = 0; i < sampled.size(); ++i) {
        EXPECT_TRUE(sampled[i] == 1 || sampled[i] == 16) << i << ": in each of 16 views or in one";
        in_turn += sampled[i] == 1 ? 1 : 0;
    }
    EXPECT_GT(in_turn, 96 * 96 / 2);
}

TEST(SparedPixels, BesideEdgesAreSampled)
{
    Spared spared;
    SparedPixels pixels = spared.at(5);
    int beside = 0;
    for (std::size_t i = 0; i < spared.now.points.size(); ++i) {
        if (!spared.places[i].is_seen() || spared.places[i].is_whole) continue;
        ++beside;
        EXPECT_FALSE(pixels.has(i)) << i;
    }
    EXPECT_GT(beside, 60);
}

TEST(SparedPixels, HaveTheLightThatTheirSamplesWouldBring)
{
    Spared spared;
    const PastDirect past{spared.places, spared.light, spared.all, 1e-3f, {}, 0, 0};
    const test::SeenPlace& now = spared.now;
    std::uint64_t rays = 0;
    const DirectLightResult own =
        direct_light(now.rays, now.points, now.view, now.shading, spared.settings, spared.now.pool, rays);
    const SparedPixels pixels(&past, DirectLight(now.rays, spared.settings), now.points, now.view, spared.now.pool,
                              spared.workspaces);
    DirectLightResult known = own;
    pixels.add_to(known);
    double all = 0.0, found = 0.0;
    int exact = 0;
    for (std::size_t i = 0; i < now.points.size(); ++i) {
        const auto light = static_cast<double>(luminance(own.irradiance[i]));
        all += light;
        found += static_cast<double>(luminance(known.irradiance[i]));
        if (!pixels.has(i) || own.in_part[i] != 0 || known.in_part[i] != 0) continue;
        const double off = std::abs(static_cast<double>(luminance(known.irradiance[i])) - light);
        EXPECT_LE(off, 0.02 * light + 1e-6) << i << ": the mean of four";
        exact += off <= 1e-5 * light ? 1 : 0;
    }
    EXPECT_NEAR(found / all, 1.0, 0.003);
    EXPECT_GT(exact, 96 * 96 / 3);
}

}  // namespace
}  // namespace rcs
