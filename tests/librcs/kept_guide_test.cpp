// Where to look for light goes on from scene to scene where things move.
#include "session/kept_guide.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/render.h"
#include "session/session_state.h"
#include "support/effect_scenes.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

/// Looks do good there, for records and along the floor's lobes; a box moves below the ceiling.
Scene scene_at(int step, float lamp = 9.0f)
{
    Scene scene = test::screened_room(0.4f);
    scene.lights.clear();
    test::add_mesh(scene, test::quad({1.4f, 0.6f, 0.3f}, {0, 0, 0.4f}, {0.4f, 0, 0},
                                     test::add_material(scene, glm::vec3(0.0f), glm::vec3(lamp))));
    test::add_mesh(scene, test::box({1.5f, 2.4f, -1.2f}, {1.7f, 2.5f, -1.0f}, 0, test::Facing::outwards));
    scene.instances.back().world_from_object[3].z += 0.05 * step;
    return scene;
}

struct Walk {
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool, {.keep_records = true, .watch_records = true}};

    const KeptGuide& show(const Scene& scene)
    {
        session.show(scene);
        last = render(session, scene.cameras[0], test::options_of_size(96, 96, 1));
        return *session.state().guide;
    }
    RenderResult last;
};

TEST(KeptGuide, FollowsWhatMoves)
{
    Walk walk;
    ASSERT_TRUE(walk.show(scene_at(0)).guide);
    const GatherGuide* const first = walk.session.state().guide->guide.get();
    std::uint64_t looks = 0;
    for (int step = 1; step <= 3; ++step) {
        const KeptGuide& kept = walk.show(scene_at(step));
        EXPECT_EQ(kept.guide.get(), first) << step << ": nobody searched";
        ASSERT_EQ(kept.moved.size(), 1u) << "one thing moves";
        EXPECT_NEAR(kept.moved[0].max.z - kept.moved[0].min.z, 0.2 + 0.05 * step, 1e-5);
        const std::vector<LitPoint>& points = kept.guide->lit().points;
        EXPECT_TRUE(std::any_of(points.begin(), points.end(), [](const LitPoint& p) { return p.bound == 0.0f; }))
            << "behind it, seen from the lamp";
        EXPECT_GT(walk.last.stats.traced.looks, 0u);
        looks += walk.last.stats.records.looks;
    }
    EXPECT_GT(looks, 0u);
}

TEST(KeptGuide, IsSearchedForAnewWhereLampsChange)
{
    Walk walk;
    ASSERT_TRUE(walk.show(scene_at(0)).guide);
    walk.show(scene_at(1));
    const KeptGuide& kept = walk.show(scene_at(1, 3.0f));
    EXPECT_TRUE(kept.moved.empty());
    EXPECT_TRUE(kept.guide);
}

TEST(KeptGuide, FollowsNoChangesThatItHasNotHeardOf)
{
    Walk walk;
    ASSERT_TRUE(walk.show(scene_at(0)).guide);
    KeptGuide kept = *walk.session.state().take_guide();
    const std::uint32_t scene = kept.scene_number;
    const Bounds box{{0, 0, 0}, {1, 1, 1}}, beside{{1.5, 0, 0}, {2, 1, 1}}, between{{0.5, 0, 0}, {1.6, 1, 1}};
    const std::vector<SceneChange> late{{scene + 2, false, {box}, {0}}}, everywhere{{scene + 1, true, {}, {}}};
    EXPECT_FALSE(kept.follow(scene + 2, late));
    EXPECT_FALSE(kept.follow(scene + 1, everywhere));
    EXPECT_EQ(kept.scene_number, scene);
    const std::vector<SceneChange> all{{scene + 1, false, {box, beside}, {0}}, {scene + 2, false, {between}, {0}}};
    EXPECT_TRUE(kept.follow(scene + 1, {all.data(), 1}));
    EXPECT_EQ(kept.moved.size(), 2u);
    EXPECT_TRUE(kept.follow(scene + 2, all));
    ASSERT_EQ(kept.moved.size(), 1u) << "what lies between joins them";
    EXPECT_EQ(kept.moved[0].min, box.min);
    EXPECT_EQ(kept.moved[0].max, beside.max);
}

}  // namespace
}  // namespace rcs
