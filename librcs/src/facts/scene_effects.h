#pragma once

#include <optional>

#include "rcs/effect_plan.h"
#include "rcs/ray_scene.h"

namespace rcs {

/// Effects as a stage takes them when nobody has planned for it: all that the scene has, wherever it lies.
EffectSet scene_effects(const RayScene& rays);

inline EffectSet effects_or_scene(const std::optional<EffectSet>& effects, const RayScene& rays)
{
    return effects ? *effects : scene_effects(rays);
}

}  // namespace rcs
