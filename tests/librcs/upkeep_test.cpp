#include "render/upkeep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/render.h"
#include "session/session_state.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

/// The block of the furnished room moved along the floor.
Scene moved_by(double distance)
{
    Scene scene = test::furnished_room();
    scene.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(distance, 0.0, 0.0));
    return scene;
}

/// Of records that a view to the side of another adds to those of that.
struct Newcomers {
    std::size_t count = 0;
    double noise = 0.0, rays = 0.0;  ///< in the mean
};

/// @param moved  by so much the block between the views
Newcomers newcomers(double moved)
{
    RenderOptions options;
    options.width = options.height = 64;
    options.aa = 1;
    options.quality = QualitySettings{.noise_target = 0.01f};  // most records are refined
    ThreadPool pool{2};
    Session session{test::shared_gl(), pool, {.keep_records = true, .watch_records = true}};
    const auto show = [&](double block, double turn) {
        const Scene scene = moved_by(block);
        session.show(scene);
        Camera camera = scene.cameras[0];
        camera.world_from_view = glm::rotate(camera.world_from_view, turn, glm::dvec3(0.0, 1.0, 0.0));
        render(session, camera, options);
    };
    show(0.0, 0.0);
    std::set<std::tuple<float, float, float>> known;
    for (const Record& r : session.records()) known.insert({r.position.x, r.position.y, r.position.z});
    show(moved, 0.5);
    Newcomers result;
    for (const Record& r : session.records()) {
        if (r.watch.instance == 1 || known.contains({r.position.x, r.position.y, r.position.z}))
            continue;  // not those of the block
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
    const Newcomers still = newcomers(0.0), moving = newcomers(0.05);
    EXPECT_GT(still.count, 100u);
    EXPECT_GT(moving.count, 100u);
    EXPECT_LT(moving.rays, 0.92 * still.rays);
    EXPECT_GT(moving.noise, 1.02 * still.noise);
    EXPECT_LT(moving.noise, 1.4 * still.noise);
}

}  // namespace
}  // namespace rcs
