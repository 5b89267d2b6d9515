#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "hit_light/hit_radiance.h"
#include "lamps/gathered_lamps.h"
#include "lit_points/surface_pieces.h"
#include "material/moving_views.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A point on a surface that reflects light of lamps or sky, or on a lamp, and stands for the area around it: what
/// choosing takes.
struct LitPoint {
    glm::vec3 position;
    float power;       ///< luminance of radiance times area, about the same all around, over the mean of all; > 0
    glm::vec3 normal;  ///< of the face, unit, to the lit side
    float bound;       ///< GatherGuide::bound() there [m^-2]
};
/// The rest of it: what its light takes.
struct LitPointLight {
    static constexpr std::uint32_t kPlain = 0xffffffffu, kLamp = 0xfffffffeu;

    glm::vec3 radiance_area;  ///< radiance of a white surface, or of the lamp, times area [W sr^-1]
    glm::vec3 to_light;       ///< unit: where that comes from
    glm::vec3 normal;         ///< shading, unit
    float position_error;     ///< of its place [m]
    glm::vec3 color;          ///< of a plain surface's base
    int material;
    std::uint32_t bsdf;   ///< index into LitPoints::bsdfs, of a surface that is not plain; kPlain; kLamp: all above but
                          ///< the first is unset
    std::uint32_t place;  ///< that was lit
    std::uint32_t lamp;   ///< of a lamp: HitRadiance::lamp_number()
};

struct LitPoints {
    std::vector<LitPoint> points;
    std::vector<LitPointLight> lights;  ///< one for each
    std::vector<Bsdf> bsdfs;

    /// Where a ray from a place to a point ends, moved off the point's surface.
    glm::vec3 end_of_ray(std::size_t point, glm::vec3 from) const;
    /// Radiance times area towards a place. @param outgoing  unit
    glm::vec3 radiance_area(const HitRadiance& radiance, std::size_t point, glm::vec3 outgoing) const;
    /// How that changes as the place moves. @param distance  to it [m]   @param frame  of its moves
    ChangeAlong moving_of_radiance_area(std::size_t point, glm::vec3 outgoing, float distance,
                                        const Basis& frame) const;
};

/// A place to be lit, and the area that it stands for.
struct PlaceToLight {
    PointOnPiece place;
    float area;  ///< [m^2]
};
/// How places are lit.
struct PlaceLight {
    const RayScene& rays;
    HitRadiance radiance;                  ///< with or without a light cache: only lamps and sky count
    float least_alpha;                     ///< of lobes, as at hits of rays: least_hit_alpha()
    const GatheredLamps* lamps = nullptr;  ///< if given, places lie on them, and it is their own light that counts
};
/// Lights each place by one sample of the lamps and one of the sky. What stays dark is left out.
LitPoints light_places(const PlaceLight& light, std::span<const PlaceToLight> places, std::uint64_t key,
                       ThreadPool& pool);

}  // namespace rcs
