#include <algorithm>
#include <span>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/render.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

/// The furnished room through three small panes, one behind the other.
Scene behind_panes()
{
    Scene scene = test::furnished_room();
    Material glass;
    glass.alpha_mode = AlphaMode::blend;
    glass.alpha = 0.4f;
    scene.materials.push_back(glass);
    const Camera& camera = scene.cameras[0];
    const glm::vec3 eye(camera.world_from_view[3]), right(camera.world_from_view[0]), up(camera.world_from_view[1]);
    for (const float away : {0.5f, 0.6f, 0.7f}) {
        const glm::vec3 corner = eye - away * glm::vec3(camera.world_from_view[2]) - 0.2f * right - 0.15f * up;
        test::add_mesh(scene,
                       test::quad(corner, 0.16f * right, 0.16f * up, static_cast<int>(scene.materials.size()) - 1));
    }
    return scene;
}

const RenderOptions kSmall = test::options_of_size(96, 64, 1);

std::vector<glm::vec3> places_of(std::span<const Record> records)
{
    std::vector<glm::vec3> places;
    for (const Record& r : records) places.push_back(r.position);
    return places;
}

TEST(LookBehind, LeavesTheSessionItsRecords)
{
    const Scene scene = behind_panes();
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool, {.keep_records = true});
    session.show(scene);
    const RenderResult first = render(session, scene.cameras[0], kSmall);
    EXPECT_EQ(first.stats.counts.peeled_layers, 3u);
    const std::vector<glm::vec3> places = places_of(session.records());
    EXPECT_EQ(places.size(), first.stats.records.records);
    const RenderResult again = render(session, scene.cameras[0], kSmall);
    EXPECT_LE(again.stats.records.records, places.size() / 100);
    const std::vector<glm::vec3> then = places_of(session.records());
    ASSERT_GE(then.size(), places.size());
    EXPECT_TRUE(std::equal(places.begin(), places.end(), then.begin())) << "in their order";
}

TEST(LookBehind, APictureThatIsCalledOffBehindLosesNone)
{
    const Scene scene = behind_panes();
    ThreadPool pool(2);
    Session session(test::shared_gl(), pool, {.keep_records = true});
    session.show(scene);
    int layers = 0;
    const RenderHooks hooks{.progress = [&](std::string_view stage, float done) {
        layers += stage == "gbuffer" && done == 0.0f ? 1 : 0;
        return layers < 3;  // behind the first panes, where what lies beside them has been set aside
    }};
    EXPECT_THROW(render(session, scene.cameras[0], kSmall, hooks), Error);
    const std::size_t known = session.records().size();
    Session other(test::shared_gl(), pool, {.keep_records = true});
    other.show(scene);
    const RenderResult whole = render(other, scene.cameras[0], kSmall);
    EXPECT_GE(known, whole.stats.records.records * 3 / 4) << "of all that there is to be known";
    const RenderResult then = render(session, scene.cameras[0], kSmall);
    EXPECT_LE(then.stats.records.records, whole.stats.records.records / 4);
}

}  // namespace
}  // namespace rcs
