#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/ray_scene.h"

namespace rcs {

/// Four words of a buffer.
using DeviceWords = std::array<std::uint32_t, 4>;

/// A ray as rays.comp reads it.
struct DeviceRay {
    glm::vec3 origin;
    float end;  ///< < 0: there is none
    glm::vec3 direction;
    float unused;
};
/// What it met, as rays.comp writes it.
struct DeviceHit {
    float t, u, v;
    std::uint32_t instance;  ///< or RCS_DEVICE_MISS, RCS_DEVICE_UNDECIDED
    glm::vec3 normal;        ///< object space if the instance is traced as one, not unit
    std::uint32_t primitive;
};
static_assert(sizeof(DeviceRay) == 32 && sizeof(DeviceHit) == 32);

/// The surfaces of a scene as shaders/shared/device_scene.h lays them out: a hierarchy over the triangles in scene
/// space, one over the instances, and one for each mesh that is instanced.
struct DeviceScene {
    std::vector<DeviceWords> nodes, triangles, instances;
    std::uint32_t root = 0, root_of_instances = 0;

    std::size_t bytes() const { return sizeof(DeviceWords) * (nodes.size() + triangles.size() + instances.size()); }
};

/// Triangles with a corner that is no number, or beyond what Embree takes, are left out, as Embree does.
/// @throws Error unsupported: more nodes or triangles than a word can tell apart; as build_hierarchy()
DeviceScene make_device_scene(const RayScene& rays);

}  // namespace rcs
