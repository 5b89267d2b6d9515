#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "rcs/ray_scene.h"
#include "scene/mesh_traits.h"

namespace rcs {

/// What a scene has, wherever it lies.
struct SceneFacts {
    std::size_t punctual = 0, triangles = 0, instanced = 0, used_meshes = 0, shared_meshes = 0;
    bool sky = false, peaks = false, lamps = false;
    int most_lobes = 0;  ///< of a point
    double most_albedo = 0.0;
    float least_roughness = 1.0f, most_roughness = 0.0f;
    std::array<std::size_t, kTraits> meshes{};  ///< with a trait, that have instances
    std::uint32_t declared = 0, simulated = 0;  ///< by any of them

    std::size_t with(Trait trait) const
    {
        return meshes[static_cast<std::size_t>(std::countr_zero(static_cast<std::uint32_t>(trait)))];
    }
};
SceneFacts scene_facts(const RayScene& rays);

}  // namespace rcs
