#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lamps/lights.h"
#include "rays/surface.h"
#include "rcs/ray_scene.h"

namespace rcs {

/// An emissive triangle, and where in the scene it is.
struct LampTriangle {
    glm::vec3 corner[3];
    glm::vec3 normal;    ///< unit, of the front side
    glm::vec3 radiance;  ///< without texture: at least what it emits anywhere
    float area;          ///< [m^2], > 0
    std::uint32_t instance, primitive;
    bool double_sided, textured;
};

/// All lamps that have a place or a direction: punctual lights and emissive triangles.
struct LampList {
    std::vector<PunctualLamp> punctual;
    std::vector<LampTriangle> triangles;
    std::vector<double> power;  ///< running sums over the triangles; used where they are too many to weigh each
    std::vector<std::vector<std::uint32_t>> triangle_of;  ///< by instance (empty: emits nothing) and primitive

    bool weighs_triangles() const { return triangles.size() <= kMostWeighed; }
    static constexpr std::size_t kMostWeighed = 256;  // 10 ns each, a ray some 500
    static constexpr std::uint32_t kNone = 0xffffffffu;
};
LampList list_lamps(const RayScene& rays);

/// Cosine of a direction to the shading normal where it is above both horizons, else 0.
inline float receiving_cosine(const SurfacePoint& point, glm::vec3 unit_direction)
{
    return glm::dot(unit_direction, point.geometric_normal) > 0.0f
               ? glm::max(0.0f, glm::dot(unit_direction, point.shading_normal))
               : 0.0f;
}

/// The lamps as one point sees them: how much each would add to its irradiance if nothing stood between.
struct LampsAtPoint {
    std::vector<PunctualSample> punctual;  ///< those with something to add
    std::vector<std::uint32_t> triangles;  ///< the same, ascending; or empty where they are chosen by power
    std::vector<float> cumulative;         ///< of weights, punctual lamps first, then triangles or all of them as one
};

enum class Lamps { all, with_area };
void weigh_lamps(const LampList& lamps, const SurfacePoint& point, Lamps which, LampsAtPoint& result);

/// Light from a lamp chosen in proportion to its weight.
struct LampSample {
    glm::vec3 direction{0.0f};  ///< unit
    glm::vec3 light{0.0f};      ///< radiance / density, shadows included; times cosine and BSDF it is an estimate
    float density = 0.0f;       ///< [1/sr]; 0: punctual, no other way to find it
};
LampSample sample_lamp(const RayScene& rays, const LampList& lamps, const SurfacePoint& point,
                       const LampsAtPoint& weights, glm::vec2 u);

/// Density with which sample_lamp() finds the point of a triangle that a ray from `point` has hit [1/sr].
float lamp_density(const LampList& lamps, const LampsAtPoint& weights, const SurfacePoint& point, const Hit& hit,
                   glm::vec3 direction);

/// What one punctual light sends to a point: irradiance on a plane that faces it, shadows included.
glm::vec3 punctual_light(const RayScene& rays, const SurfacePoint& point, const PunctualSample& lamp);

}  // namespace rcs
