#pragma once

#include <set>
#include <string>

#include "rcs/effect_plan.h"
#include "rcs/ray_scene.h"
#include "rcs/render_options.h"

namespace rcs::test {

/// 64 x 64 pixels.
inline RenderOptions small()
{
    RenderOptions options;
    options.width = options.height = 64;
    return options;
}

/// Of the first camera.
inline EffectPlan plan_of(const Scene& scene, const RenderOptions& options, const EffectChoice& choice = {})
{
    ThreadPool pool(1);
    const RayScene rays = build_ray_scene(scene, pool, choice);
    return plan_effects(rays, scene.cameras.at(0), options);
}

/// Names of the effects that are simulated.
inline std::set<std::string> switched_on(const EffectPlan& plan)
{
    std::set<std::string> names;
    for (const PlannedEffect& e : plan.effects)
        if (e.needed) names.emplace(name_of(e.effect));
    return names;
}

inline RenderOptions with(RenderOptions options, int bounces, int aa = 4)
{
    options.bounces = bounces;
    options.aa = aa;
    return options;
}

}  // namespace rcs::test
