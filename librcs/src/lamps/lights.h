#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "rays/hit_surface.h"
#include "rays/surface.h"
#include "rcs/effect_plan.h"
#include "rcs/ray_scene.h"
#include "rcs/scene.h"

namespace rcs {

class Environment;
class LightTree;

/// Where a ray meets a plane is rounded a few times, by half an ulp each of how far the triangle's corners lie from the
/// ray's origin: the error of such a place in parts of that distance.
inline constexpr float kPlaneRounding = kPositionRoundings * kUnitRoundoff;

/// A triangle that emits, as light sampling sees it. Scene space.
struct EmissiveTriangle {
    glm::vec3 corner[3];
    glm::vec3 normal;    ///< unit, of the front side
    glm::vec3 radiance;  ///< [W m^-2 sr^-1], emitted from the front, from both sides if double_sided; mean if varied
    float area = 0.0f;   ///< [m^2], > 0
    float error = 0.0f;  ///< bound of how far a point of it lies off its plane by rounding, seen from nearby [m]
    bool double_sided = false;
    bool varied = false;  ///< by a texture or by alpha
    std::uint32_t instance = 0, primitive = 0;
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
    const RayScene* rays = nullptr;                                       ///< whose lights they are
    const Environment* sky = nullptr;                                     ///< its peaks are a lamp
    std::shared_ptr<const LightTree> tree;                                ///< of the triangles
    std::vector<std::uint32_t> first_of_instance, triangle_of_primitive;  ///< indices; kNone: does not emit

    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// The emissive triangle that a ray hit, or kNone.
    std::uint32_t emissive_triangle(std::uint32_t instance, std::uint32_t primitive) const
    {
        const std::uint32_t first = first_of_instance[instance];
        return first == kNone ? kNone : triangle_of_primitive[first + primitive];
    }
    bool has_peaks() const;
};
/// The scene's, which were found when `rays` was built. Refers to `rays`.
Lights collect_lights(const RayScene& rays);
/// Those of them that a plan has.
Lights collect_lights(const RayScene& rays, const EffectSet& effects);
/// Finds them.
Lights find_lights(const RayScene& rays);

/// Radiance of an emissive triangle at a point on it: the mean where it does not vary. Scene space.
glm::vec3 radiance_at(const RayScene& rays, const EmissiveTriangle& triangle, glm::vec3 position);

/// Whether a point lies on a triangle's plane, as far as can be told: by rounding it would seem to lie just below all
/// of it.
bool lies_on_plane(const EmissiveTriangle& triangle, const SurfacePoint& point);

/// A ray from a surface to a point on a triangle that does not meet the triangle itself. Both ends are moved off their
/// own surface, and the ray goes from one to the other: along the old direction it would pass the plane of a lamp that
/// it grazes. @param to_lamp  from `point` to there
inline Ray shadow_ray_to(const EmissiveTriangle& triangle, const SurfacePoint& point, const glm::vec3& to_lamp)
{
    const float off = triangle.error + kPlaneRounding * glm::length(to_lamp);
    const glm::vec3 lift = (glm::dot(triangle.normal, to_lamp) < 0.0f ? off : -off) * triangle.normal;
    Ray ray = ray_from(point, to_lamp);
    const glm::vec3 way = to_lamp + lift - (ray.origin - point.position);
    ray.t_max = glm::length(way);
    ray.direction = ray.t_max > 0.0f ? way / ray.t_max : glm::normalize(to_lamp);
    return ray;
}

/// What a punctual light does at a point: irradiance on a plane that faces it, the unit direction
/// towards it, and how far it is (+inf for directional). Irradiance is 0 outside range or cone.
struct PunctualSample {
    glm::vec3 irradiance;
    glm::vec3 to_light;
    float distance;
};
PunctualSample sample_punctual(const PunctualLamp& light, glm::vec3 point);

}  // namespace rcs
