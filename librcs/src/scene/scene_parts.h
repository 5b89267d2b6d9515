#pragma once

#include "rcs/scene.h"

namespace rcs {

/// Whether all is the same that an acceleration structure is built from: textures, materials, meshes and where they
/// stand.
bool same_surfaces(const Scene& a, const Scene& b);
/// Whether lamps without size and the sky are the same.
bool same_lamps(const Scene& a, const Scene& b);

}  // namespace rcs
