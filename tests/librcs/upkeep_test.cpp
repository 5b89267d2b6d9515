#include "render/upkeep.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/render.h"
#include "session/session_state.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

/// The furnished room, its block a twelfth as large, so that many records see nothing of it, and moved along the floor.
Scene moved_by(double distance)
{
    Scene scene = test::furnished_room();
    scene.instances[1].world_from_object =
        glm::scale(glm::translate(glm::dmat4(1.0), glm::dvec3(distance, 0.0, 0.0)), glm::dvec3(0.08));
    return scene;
}

/// Of records that a view to the side adds to those of two others, between which the block moves.
struct Newcomers {
    std::size_t count = 0;
    double noise = 0.0, rays = 0.0;  ///< in the mean
};

/// @param forgets  before it that light has changed
Newcomers newcomers(bool forgets)
{
    RenderOptions options;
    options.width = options.height = 64;
    options.aa = 1;
    options.quality = QualitySettings{.noise_target = 0.01f};  // most records are refined
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool, {.keep_records = true, .watch_records = true}};
    for (const double block : {0.0, 0.05}) {
        session.show(moved_by(block));
        render(session, session.scene().cameras[0], options);
    }
    std::set<std::tuple<float, float, float>> known;
    for (const Record& r : session.records()) known.insert({r.position.x, r.position.y, r.position.z});
    if (forgets) session.state().noise.slack.reset();
    Camera camera = session.scene().cameras[0];
    camera.world_from_view = glm::rotate(camera.world_from_view, 0.5, glm::dvec3(0.0, 1.0, 0.0));
    render(session, camera, options);
    Newcomers result;
    for (const Record& r : session.records()) {
        if (known.contains({r.position.x, r.position.y, r.position.z})) continue;
        ++result.count;
        result.noise += static_cast<double>(r.noise);
        result.rays += static_cast<double>(r.rays);
    }
    result.noise /= static_cast<double>(result.count);
    result.rays /= static_cast<double>(result.count);
    return result;
}

TEST(Upkeep, RecordsThatAreNewWhereLightChangesMayBeNoisier)
{
    const Newcomers better = newcomers(true), noisier = newcomers(false);
    EXPECT_GT(better.count, 100u);
    EXPECT_EQ(noisier.count, better.count);
    EXPECT_LT(noisier.rays, 0.92 * better.rays);
    EXPECT_GT(noisier.noise, 1.02 * better.noise);
    EXPECT_LT(noisier.noise, 1.3 * better.noise);
}

TEST(Upkeep, NewRecordsAreAsGoodAsEverWhereNoneFollowAChange)
{
    RenderOptions options;
    options.width = options.height = 48;
    options.aa = 1;
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool, {.keep_records = true, .watch_records = true}};
    const auto slack_after = [&](const Scene& scene) {
        session.show(scene);
        render(session, scene.cameras[0], options);
        return session.state().noise.slack;
    };
    EXPECT_FALSE(slack_after(moved_by(0.0))) << "the first scene";
    const std::optional<float> slack = slack_after(moved_by(0.05));
    ASSERT_TRUE(slack);
    EXPECT_GT(*slack, 1.05f);
    EXPECT_LE(*slack, 1.75f);
    EXPECT_EQ(slack_after(moved_by(0.05)), slack) << "the same scene";
    options.bounces = 2;
    EXPECT_FALSE(slack_after(moved_by(0.05))) << "all records are new";
    EXPECT_TRUE(slack_after(moved_by(0.1)));
    session.begin_with({});
    EXPECT_FALSE(session.state().noise.slack);
    // All of it is somewhere else.
    Scene elsewhere = moved_by(0.1);
    for (Instance& instance : elsewhere.instances)
        instance.world_from_object =
            glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.01, 0.0)) * instance.world_from_object;
    slack_after(moved_by(0.1));
    EXPECT_EQ(slack_after(elsewhere).value_or(1.0f), 1.0f);
}

TEST(Upkeep, ASessionThatKeepsNothingHasNoSlackOfTheMomentsOfAShutter)
{
    RenderOptions options;
    options.width = options.height = 32;
    options.aa = 4;
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool};
    const Scene first = moved_by(0.0);
    session.show(first);
    render(
        session,
        [](double part) {
            Scene scene = moved_by(0.1 * part);
            const Camera camera = scene.cameras[0];
            return Moment{std::move(scene), camera};
        },
        options);
    EXPECT_FALSE(session.state().noise.slack);
}

}  // namespace
}  // namespace rcs
