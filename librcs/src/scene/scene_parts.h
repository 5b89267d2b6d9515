#pragma once

#include <optional>
#include <vector>

#include "rcs/scene.h"

namespace rcs {

/// Whether all is the same that an acceleration structure is built from: textures, materials, meshes and where they
/// stand.
bool same_surfaces(const Scene& a, const Scene& b);
/// Which instances of `b` are not where and what they are in `a`, by index; none if they cannot be told apart one by
/// one, as there are more of them, of meshes, materials or textures, or fewer.
std::optional<std::vector<bool>> changed_instances(const Scene& a, const Scene& b);
/// Box around one instance, scene space; empty if it has no triangles.
Bounds bounds_of(const Scene& scene, std::size_t instance);
/// Whether lamps without size and the sky are the same.
bool same_lamps(const Scene& a, const Scene& b);

}  // namespace rcs
