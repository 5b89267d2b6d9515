#pragma once

#include <utility>

#include "facts/scene_effects.h"
#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "rcs/gbuffer.h"
#include "rcs/ray_scene.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"
#include "support/session.h"

namespace rcs::test {

/// A scene, and its points as its first camera sees them.
struct SeenPlace {
    Scene scene;
    ThreadPool pool{2};
    RayScene rays;
    View view;
    EffectSet effects;
    Shading shading;
    GBuffer points;

    /// @param size  of the view, both ways [px]
    SeenPlace(Scene s, int size)
        : scene(std::move(s)),
          rays(build_ray_scene(scene, pool)),
          view(make_views(scene.cameras[0], size, size, 1)[0]),
          effects(scene_effects(rays)),
          points(render_gbuffer(shared_gl(), rays, view, 1.0f, pool, effects, shading))
    {
    }
    SeenPlace(const SeenPlace&) = delete;
};

}  // namespace rcs::test
