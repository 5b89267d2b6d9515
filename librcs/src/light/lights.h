#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "rcs/ray_scene.h"
#include "rcs/scene.h"

namespace rcs {

/// A triangle that emits, as light sampling sees it. Scene space.
struct EmissiveTriangle {
    glm::vec3 corner[3];
    glm::vec3 normal;    ///< unit, of the front side
    glm::vec3 radiance;  ///< [W m^-2 sr^-1], emitted from the front, from both sides if double_sided
    float area = 0.0f;   ///< [m^2], > 0
    bool double_sided = false;
};

/// A punctual light, with the cosines that every look at it needs.
struct PunctualLamp : PunctualLight {
    PunctualLamp(const PunctualLight& light);

    double cos_inner, cos_outer;
};

/// Everything that sends light of its own, gathered from a scene.
struct Lights {
    std::vector<PunctualLamp> punctual;
    std::vector<EmissiveTriangle> triangles;
    glm::vec3 sky_radiance{0.0f};
};
Lights collect_lights(const RayScene& rays);

/// What a punctual light does at a point: irradiance on a plane that faces it, the unit direction
/// towards it, and how far it is (+inf for directional). Irradiance is 0 outside range or cone.
struct PunctualSample {
    glm::vec3 irradiance;
    glm::vec3 to_light;
    float distance;
};
PunctualSample sample_punctual(const PunctualLamp& light, glm::vec3 point);

}  // namespace rcs
