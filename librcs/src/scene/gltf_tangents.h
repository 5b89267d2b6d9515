#pragma once

#include <glm/glm.hpp>

#include "rcs/scene.h"

namespace rcs {

/// Gives a mesh the tangents that its normal texture is meant for, those of MikkTSpace: along increasing u, unit,
/// orthogonal to the normals, w = 1 where cross(normal, tangent) points up in the image (glTF's v points down). A
/// vertex whose triangles want different ones is split. A flat-shaded mesh gets face normals, each corner a vertex of
/// its own.
/// @param uv_set  0 or 1; the mesh has it   @param texture_from_uv  as in TextureSlot
void make_tangents(Mesh& mesh, int uv_set, const glm::mat3x2& texture_from_uv);

/// A unit vector orthogonal to `normal`, a unit vector.
glm::dvec3 any_tangent(glm::dvec3 normal);

}  // namespace rcs
