#pragma once

#include <cmath>

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "stability/scenes.h"

namespace rcs::stability {

/// A floor below a ceiling [-3, 3] x [-3, 3] at y = 2 that has a dielectric's lobe alone, lit by a point light of
/// intensity 1 at (0, 1, 0).
inline Scene polished_ceiling(float roughness)
{
    Scene scene;
    add_mesh(scene, quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, add_material(scene, glm::vec3(0.5f))));
    const int ceiling = add_material(scene, glossy(0.0f, roughness, glm::vec3(0.0f)));
    add_mesh(scene, quad({-3, 2, -3}, {6, 0, 0}, {0, 0, 6}, ceiling));
    scene.lights = {point_light({0.0, 1.0, 0.0}, glm::vec3(1.0f))};
    return scene;
}

/// Irradiance of its floor at (x, 0, 0): a midpoint sum over the ceiling.
inline double below_polished_ceiling(double x, float roughness)
{
    constexpr int kCells = 600;
    constexpr double kSide = 6.0;
    Bsdf ceiling;
    ceiling.normal = ceiling.geometric_normal = {0, -1, 0};
    ceiling.add(make_lobe<Specular>(glm::vec3(0.04f), 1.0f, roughness * roughness));
    double sum = 0.0;
    for (int j = 0; j < kCells; ++j) {
        for (int i = 0; i < kCells; ++i) {
            const glm::dvec3 at(kSide * ((i + 0.5) / kCells - 0.5), 2.0, kSide * ((j + 0.5) / kCells - 0.5));
            const glm::dvec3 to_light = glm::dvec3(0, 1, 0) - at, to_floor = glm::dvec3(x, 0, 0) - at;
            const double l2 = glm::dot(to_light, to_light), f2 = glm::dot(to_floor, to_floor);
            const glm::vec3 f =
                evaluate(ceiling, glm::vec3(glm::normalize(to_floor)), glm::vec3(glm::normalize(to_light)));
            sum += -to_light.y / (l2 * std::sqrt(l2)) * static_cast<double>(f.g) * to_floor.y * to_floor.y / (f2 * f2);
        }
    }
    return sum * kSide * kSide / (kCells * kCells);
}

}  // namespace rcs::stability
