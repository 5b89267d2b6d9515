#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "rcs/scene.h"

namespace rcs {

/// Tangents as MikkTSpace makes them, for which glTF's normal textures are meant: three for each triangle, corner by
/// corner, along increasing u and orthogonal to the normal, w = 1 where the texture is not mirrored, else -1. One is
/// unit, or 0 where nothing says where it points.
///
/// M. S. Mikkelsen: Simulation of wrinkled surfaces revisited, 2008, with the angle of 180 degrees that all use:
/// a tangent is the mean over the triangles about a corner that are joined by edges and mapped the same way round.
/// @param mesh  with normals   @param uvs  of its vertices, v up the image
std::vector<glm::vec4> mikktspace(const Mesh& mesh, const std::vector<glm::vec2>& uvs);

}  // namespace rcs
