#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "rcs/ray_scene.h"

namespace rcs {

/// How much of a surface is there, and the colour of the light that goes straight on through it: between its texels
/// by alpha, and through its thin wall below the specular reflection.
struct Layer {
    float coverage = 1.0f;
    glm::vec3 transmitted{0.0f};
};
Layer layer_at(const RayScene& rays, const Hit& hit, glm::vec3 direction);

/// What of the light arrives along a shadow ray, segment by segment; 0 where it is blocked.
glm::vec3 transmitted_along(const RayScene& rays, const Ray& ray);

/// The surface that a path meets, having gone through others by chance.
struct Meeting {
    std::optional<Hit> hit;  ///< empty: the sky
    glm::vec3 weight{1.0f};  ///< of what comes from there: unbiased with the chance of going through and stopping
};
/// @param u  in [0, 1): the path's own random number
Meeting next_surface(const RayScene& rays, Ray ray, float u);

}  // namespace rcs
