#include "render/upkeep.h"

#include <gtest/gtest.h>

#include <numeric>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/render.h"
#include "records/gather.h"
#include "session/session_state.h"
#include "support/scenes.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

/// The furnished room, its block an eighteenth as large, so that many records see nothing of it, and moved along the
/// floor.
Scene moved_by(double distance)
{
    Scene scene = test::furnished_room();
    scene.instances[1].world_from_object =
        glm::scale(glm::translate(glm::dmat4(1.0), glm::dvec3(distance, 0.0, 0.0)), glm::dvec3(0.055));
    return scene;
}

/// A session whose records follow what changes.
struct Watched {
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool, {.keep_records = true, .watch_records = true}};
    RenderOptions options;

    Watched()
    {
        options.width = options.height = 48;
        options.aa = 1;
    }
};

/// Of records that a view to the side adds to those of two others, between which the block moves.
struct Newcomers {
    std::size_t count = 0;
    double noise = 0.0, rays = 0.0;  ///< in the mean
};

/// @param forgets  before it that light has changed
Newcomers newcomers(bool forgets)
{
    Watched watched;
    Session& session = watched.session;
    RenderOptions& options = watched.options;
    options.width = options.height = 64;
    options.quality = QualitySettings{.noise_target = 0.01f};  // most records are refined
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

TEST(Upkeep, RecordsAreGatheredAgainByOtherRaysThanThoseThatWereLearnedFrom)
{
    Watched watched;
    Session& session = watched.session;
    RenderOptions& options = watched.options;
    session.show(test::furnished_room());
    render(session, session.scene().cameras[0], options);
    Scene lit = test::furnished_room();
    lit.lights.push_back(test::point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
    session.show(lit);
    const RenderStats stats = render(session, session.scene().cameras[0], options).stats;
    const std::uint32_t now = session.state().scene_number;
    std::vector<Record> found;
    for (const Record& r : session.records())
        if (r.watch.gathered == now && r.watch.touched == now) found.push_back(r);
    ASSERT_GT(found.size(), 50u) << "a lamp changes light everywhere";
    EXPECT_EQ(found.size(), stats.records.renewed);
    std::vector<Record> as_at_first = found;
    std::vector<std::uint32_t> all(found.size());
    std::iota(all.begin(), all.end(), 0u);
    RecordStats uncounted;
    RecordGatherer({session.rays()}, {.rays = settings_of(options).rays})
        .renew(as_at_first, all, watched.pool, uncounted);
    double sum = 0.0, off = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const auto first = static_cast<double>(luminance(as_at_first[i].irradiance));
        const double difference = static_cast<double>(luminance(found[i].irradiance)) - first;
        EXPECT_NE(difference, 0.0) << "not those of when it was first gathered";
        sum += first;
        off += difference;
    }
    EXPECT_NEAR(off / sum, 0.0, 0.01);
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
    Watched watched;
    Session& session = watched.session;
    RenderOptions& options = watched.options;
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
