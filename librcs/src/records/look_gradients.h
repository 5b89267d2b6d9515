#pragma once

#include <glm/glm.hpp>

namespace rcs {

/// Cosine below which a float does not tell whether a surface is seen at all, with a hundred roundings to spare. What
/// light comes from there is as good as none, and over its cosine it could be any.
inline constexpr float kEdgeOn = 1e-5f;

/// How light that is looked at changes as the record turns, over that light [1/rad].
/// @param normal  the record's, unit @param direction  to the light, unit. In the tangent plane, as far as can be told:
/// 0
inline glm::vec3 turning_of_look(glm::vec3 normal, glm::vec3 direction)
{
    const float cosine = glm::dot(normal, direction);
    return cosine > kEdgeOn ? glm::cross(normal, direction) / cosine : glm::vec3(0.0f);
}

/// How the geometry term to a lit point changes as the record moves in its tangent plane, over that term [1/m].
/// @param normal  the record's, unit @param to  the point, from the record [m] @param point_normal  unit. Seen edge on,
/// as far as can be told: 0
inline glm::vec3 moving_of_look(glm::vec3 normal, glm::vec3 to, glm::vec3 point_normal)
{
    const float facing = glm::dot(point_normal, to);
    if (!(facing < -kEdgeOn * glm::length(to))) return glm::vec3(0.0f);
    const glm::vec3 gradient = 4.0f / glm::dot(to, to) * to - point_normal / facing;
    return gradient - glm::dot(gradient, normal) * normal;
}

}  // namespace rcs
