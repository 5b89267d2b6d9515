#pragma once

#include <cstdint>
#include <vector>

#include "rcs/camera.h"
#include "rcs/gl_context.h"
#include "rcs/scene.h"

namespace rcs {

/// Which triangle the sample of each pixel sees, row by row from the top left.
struct Visibility {
    std::vector<std::uint32_t> instance, primitive;  ///< 0xffffffff where nothing is seen
};

/// Rasterises the scene with OpenGL. Back faces of materials that are not double-sided are left out;
/// of triangles at the same depth the one drawn first is seen (order of instances, then of triangles).
/// An edge lies where it should to the GL's subpixel grid, usually 1/256 px.
/// @throws Error unsupported: an image larger than the GL can draw
Visibility render_visibility(GlContext& gl, const Scene& scene, const View& view);

}  // namespace rcs
