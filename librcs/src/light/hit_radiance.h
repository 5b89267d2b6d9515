#pragma once

#include <limits>
#include <numbers>

#include <glm/glm.hpp>

#include "light/hit_light.h"
#include "light_cache/light_cache_impl.h"
#include "rays/hit_surface.h"
#include "rcs/ray_scene.h"
#include "scene/surface.h"
#include "util/random.h"

namespace rcs {

/// The mip level at which a texel is about as wide as a ray's cone. @param cone_width  at the hit [m]
int mip_level(const Texture& texture, float uv_per_length, float cone_width);

/// Light that leaves surfaces which rays hit, towards where the rays came from. Its direct part, from lamps and
/// sky, still needs a shadow ray for each of its terms; the rest is looked up in a light cache.
class HitRadiance {
public:
    /// @param cache  may be null: then there is no more than the direct part
    HitRadiance(const RayScene& rays, const LightCache* cache);

    bool has_cache() const { return cache_ != nullptr; }
    glm::vec3 sky_radiance() const { return sky_; }

    /// False only if neither lamps nor sky reach the side of a surface that this unit normal looks to: quick.
    bool may_be_lit(glm::vec3 geometric_normal) const { return has_sky_ || lights_.may_reach(geometric_normal); }

    /// The direct part for a white Lambertian surface: calls add(shadow ray, radiance if it is free) for each term.
    template <typename Add>
    void direct(const SurfacePoint& point, RandomStream& random, const Add& add) const;

    /// Irradiance from light that has been reflected before; 0 without a cache. [W m^-2]
    glm::vec3 indirect_irradiance(const SurfacePoint& point, RandomStream& random) const
    {
        return cache_ ? cached_irradiance(*cache_, point.position, point.shading_normal, random) : glm::vec3(0.0f);
    }

    /// Albedo of a Lambertian material. @param cone_width  of the ray at the hit [m]
    glm::vec3 albedo(int material, glm::vec2 uv, float uv_per_length, float cone_width) const;

private:
    const Scene& scene_;
    const LightCache* cache_;
    HitLights lights_;
    glm::vec3 sky_;
    bool has_sky_;
};

/// A direction over the point, in proportion to the cosine to its shading normal.
glm::vec3 cosine_direction(const SurfacePoint& point, RandomStream& random);

template <typename Add>
void HitRadiance::direct(const SurfacePoint& point, RandomStream& random, const Add& add) const
{
    const HitLights::Sample lamp = lights_.sample(point, random);
    if (lamp.irradiance != glm::vec3(0.0f))
        add(shadow_ray_from(point, lamp.to_light, lamp.distance), std::numbers::inv_pi_v<float> * lamp.irradiance);
    if (has_sky_) {
        const glm::vec3 direction = cosine_direction(point, random);
        if (glm::dot(direction, point.geometric_normal) > 0.0f)
            add(shadow_ray_from(point, direction, std::numeric_limits<float>::infinity()), sky_);
    }
}

}  // namespace rcs
