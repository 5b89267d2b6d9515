#pragma once

#include <array>

#include <glm/glm.hpp>

namespace rcs {

/// Directions of increasing u (tangent) and decreasing v (bitangent: glTF's v runs down the image) on a triangle;
/// both 0 where its texture coordinates span no area. Not unit.
struct TangentPair {
    glm::vec3 tangent{0.0f}, bitangent{0.0f};
};
TangentPair tangents_from_uvs(const std::array<glm::vec3, 3>& corners, const std::array<glm::vec2, 3>& uvs);

/// A direction of tangent space on the surface; 0 where the frame is degenerate. @param normal  unit, of the front side
glm::vec3 mapped_direction(glm::vec3 normal, TangentPair frame, glm::vec2 direction);

/// @param texel  of the normal texture, in [0, 1]   @param normal  unit, of the front side
/// @param frame  made orthonormal to `normal` here; `normal` is returned where it is degenerate
glm::vec3 mapped_normal(glm::vec3 normal, TangentPair frame, glm::vec3 texel, float scale);

/// A unit normal like `shading` whose mirror direction of the viewer lies above the geometric surface, and which
/// the viewer sees from the front. @param outgoing  unit, above the geometric normal
glm::vec3 keep_mirror_above(glm::vec3 shading, glm::vec3 geometric, glm::vec3 outgoing);

}  // namespace rcs
