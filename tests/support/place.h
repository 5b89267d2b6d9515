#pragma once

#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/views.h"
#include "rcs/gbuffer.h"
#include "rcs/ray_scene.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"
#include "support/floor_points.h"

namespace rcs::test {

/// A scene, and points of its floor that look around in it.
struct Place {
    Scene scene;
    ThreadPool pool{2};
    RayScene rays;
    GBuffer points;
    View view;

    /// @param floor  points (x, z) of it
    Place(Scene s, const std::vector<glm::vec2>& floor)
        : scene(std::move(s)),
          rays(build_ray_scene(scene, pool)),
          points(points_on_floor(floor)),
          view(make_views(scene.cameras[0], 64, 64, 1)[0])
    {
    }
    Place(const Place&) = delete;
};

}  // namespace rcs::test
