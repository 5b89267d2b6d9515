#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/glm.hpp>

#include "cells/light_cache_impl.h"
#include "hit_light/hit_light.h"
#include "hit_light/lamp_finder.h"
#include "lamps/gathered_lamps.h"
#include "material/bsdf.h"
#include "rays/hit_surface.h"
#include "rays/surface.h"
#include "rays/surface_material.h"
#include "rcs/ray_scene.h"
#include "scene/environment.h"
#include "util/basis.h"
#include "util/counters.h"
#include "util/random.h"

namespace rcs {

/// The mip level at which a texel is about as wide as a ray's cone. @param cone_width  at the hit [m]
int mip_level(const Texture& texture, float uv_per_length, float cone_width);

/// Light that leaves surfaces which rays hit, towards where the rays came from. Its direct part, from lamps and
/// sky, still needs a shadow ray for each of its terms; the rest is looked up in a light cache.
class HitRadiance {
public:
    /// @param cache  may be null: then there is no more than the direct part
    /// @param gathered  may be null, else it says how their light is found
    HitRadiance(const RayScene& rays, const LightCache* cache, const EffectSet& effects,
                const GatheredLamps* gathered = nullptr);

    bool has_cache() const { return cache_ != nullptr; }
    /// Whether each_light() has any that is soft.
    bool has_soft() const { return gathered_ || (has_sky_ && !environment_.is_black()); }
    glm::vec3 sky_radiance() const { return sky_; }
    const Environment& environment() const { return environment_; }

    /// False only if neither lamps nor sky reach the side of a surface that this unit normal looks to, nor the other
    /// one where light from there counts: quick.
    bool may_be_lit(std::uint32_t instance, glm::vec3 geometric_normal) const
    {
        return has_sky_ || lights_.may_reach(geometric_normal) ||
               (lit_behind_[instance] != 0 && lights_.may_reach(-geometric_normal));
    }

    /// The direct part for a white Lambertian surface: calls add(shadow ray, radiance if it is free) for each term.
    template <typename Add>
    void direct(const SurfacePoint& point, RandomStream& random, const Add& add) const;
    /// The same; add() is also given a function that says how often that is done per steradian about there, 0 if no ray
    /// could find the light, and whether the light is soft, from sky or lamps so large that it changes slowly.
    template <typename Add>
    void each_light(const SurfacePoint& point, RandomStream& random, const Add& add) const;

    /// The same of gathered lamps alone, which are found by who is given with them: irradiance.
    template <typename Add>
    void each_gathered(const SurfacePoint& point, RandomStream& random, const Add& add) const;

    /// Irradiance from light that has been reflected before; 0 without a cache. [W m^-2]
    /// @param fewer  bounces to leave out of those that the cache has
    glm::vec3 indirect_irradiance(const SurfacePoint& point, RandomStream& random, int fewer = 0) const
    {
        return cache_ ? cached_irradiance(*cache_, point.position, point.shading_normal, random, fewer)
                      : glm::vec3(0.0f);
    }

    /// Whether a ray may find light of lamps or sky: false only if it does not.
    bool may_find_light(glm::vec3 origin, glm::vec3 unit_direction) const;
    /// What lamps send from a hit to the ray's origin.
    glm::vec3 emission(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width) const;
    /// The same, wherever. @param outgoing  unit   @param width  of the texture filter
    glm::vec3 emission(const Hit& hit, const SurfacePoint& point, glm::vec3 outgoing, float width) const;
    /// The number, as of HitLights::Sample, of a triangle that emits.
    std::uint32_t lamp_number(const Hit& hit) const
    {
        return lights_.triangle_lamp(lights_.lights().emissive_triangle(hit.instance, hit.primitive));
    }
    /// How often each_light() at the ray's origin finds a lamp there, the soft sky, and its peaks [1/sr].
    float density_of_lamp(const SurfacePoint& origin, const HitPacket& packet, int lane) const;
    float density_of_sky(const SurfacePoint& origin, glm::vec3 direction) const
    {
        return std::numbers::inv_pi_v<float> * std::max(0.0f, glm::dot(origin.shading_normal, direction));
    }
    float density_of_peaks(const SurfacePoint& origin, glm::vec3 direction) const
    {
        return environment_.has_peaks() ? lights_.density(origin, lights_.peaks_lamp(), direction) : 0.0f;
    }

    /// Whether this instance's surface is its base colour below at most a wide lobe (kLikeDiffuseAlpha) that is the
    /// same everywhere: then albedo() and reflectance() say all, quickly.
    bool is_plain(std::uint32_t instance) const { return plain_[instance] != 0; }
    /// Where on which plain surface: what a look at its textures takes. @param cone_width  of the ray at the hit [m]
    struct PlainHit {
        int material;
        glm::vec2 uv;
        float uv_per_length;
        float cone_width;
    };
    /// Albedo of a plain surface, that of its lobe included, for light from everywhere. @param cosine  of the ray to
    /// the shading normal
    glm::vec3 albedo(const PlainHit& hit, float cosine) const;
    /// The same for light from one direction: pi times the BSDF. The lobe has a twentieth of the light or less, but a
    /// sun over walls sends that all one way: taken for diffuse, Sponza's floor came out a tenth too dark.
    glm::vec3 reflectance(const PlainHit& hit, glm::vec3 normal, glm::vec3 outgoing, glm::vec3 incoming) const;

    /// The same, its base's colour known. @param normal  shading
    glm::vec3 reflectance(int material, glm::vec3 color, glm::vec3 normal, glm::vec3 outgoing,
                          glm::vec3 incoming) const;
    glm::vec3 base_color(const PlainHit& hit) const;

    /// What any other surface is towards the origin of a packet's ray, as it is, and with lobes after widen_at_hit().
    /// @param hit  complete   @param least_alpha  least_hit_alpha() of the rays
    MaterialValues values(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width) const;
    MaterialValues widened_values(const HitPacket& packet, int lane, const HitSurface& hit, float cone_width,
                                  float least_alpha) const;
    /// The latter, wherever. @param outgoing  unit   @param width  of the texture filter
    MaterialValues widened_values(const Hit& hit, const SurfacePoint& point, glm::vec3 outgoing, float width,
                                  float least_alpha) const;
    /// Light that has been reflected before, for it. @param outgoing  unit, towards the ray's origin
    glm::vec3 indirect(const SurfacePoint& point, const Bsdf& bsdf, glm::vec3 outgoing, RandomStream& random) const;
    /// The direct part for it. @param outgoing  unit, towards the ray's origin   @param add  is also given what of
    /// that light a white Lambertian surface would send, 0 where it comes from behind
    template <typename Add>
    void direct(const SurfacePoint& point, const Bsdf& bsdf, glm::vec3 outgoing, RandomStream& random,
                const Add& add) const;

private:
    /// What of a sample's light the finder of gathered lamps does not bring; often nothing. @return whether it is
    /// theirs
    bool leave_to_finder(const SurfacePoint& point, RandomStream& random, HitLights::Sample& lamp) const;
    MaterialValues values(const Hit& hit, const SurfacePoint& point, glm::vec3 outgoing, float width) const;

    const RayScene& rays_;
    const Scene& scene_;
    const LightCache* cache_;
    HitLights lights_;
    const GatheredLamps* gathered_;  // with a finder, or null
    glm::vec3 sky_;
    const Environment& environment_;
    bool has_sky_, has_textures_;
    std::vector<std::uint8_t> plain_, lit_behind_;  // per instance, 0 or 1
    std::vector<Bsdf> layer_;                       // per material: above the diffuse base of plain surfaces
    std::vector<glm::vec3> mean_color_;             // per material: of its base
};

/// Directional albedo of all that reflects: radiance towards `outgoing` times pi, per irradiance, if that is uniform.
inline glm::vec3 total_albedo(const Bsdf& bsdf, glm::vec3 outgoing)
{
    return albedo(bsdf, outgoing, ~transmitting_lobes(bsdf));
}

template <typename Add>
void HitRadiance::each_light(const SurfacePoint& point, RandomStream& random, const Add& add) const
{
    const auto add_lamp = [&](const HitLights::Sample& lamp, bool soft) {
        if (lamp.irradiance == glm::vec3(0.0f)) return;
        tally(Count::hit_lamp_rays);
        add(
            lamp.shadow_ray, std::numbers::inv_pi_v<float> * lamp.irradiance,
            [&] { return lights_.density(point, lamp.lamp, lamp.to_light); }, soft);
    };
    HitLights::Sample lamp = lights_.sample(point, random);
    bool gathered = false;
    if (gathered_) {
        gathered = leave_to_finder(point, random, lamp);
        add_lamp(gathered_->finder->sample(point, random), true);
    }
    add_lamp(lamp, gathered);
    if (has_sky_) {
        // Where the sky is black its samples must not move those that follow: a picture does not change by it.
        RandomStream of_black = random;
        RandomStream& stream = environment_.is_black() ? of_black : random;
        const float sin2 = stream.next(), turn = stream.next();
        const glm::vec3 direction = cosine_direction(point.shading_normal, {sin2, turn});
        if (glm::dot(direction, point.geometric_normal) > 0.0f) {
            tally(Count::hit_sky_rays);
            add(
                ray_from(point, direction), environment_.soft_blurred(direction),
                [&] { return density_of_sky(point, direction); }, true);
        }
    }
}

template <typename Add>
void HitRadiance::each_gathered(const SurfacePoint& point, RandomStream& random, const Add& add) const
{
    if (!gathered_) return;
    HitLights::Sample any = lights_.sample(point, random);
    const HitLights::Sample found = gathered_->finder->sample(point, random);
    if (leave_to_finder(point, random, any) && any.irradiance != glm::vec3(0.0f)) add(any.shadow_ray, any.irradiance);
    if (found.irradiance != glm::vec3(0.0f)) add(found.shadow_ray, found.irradiance);
}

template <typename Add>
void HitRadiance::direct(const SurfacePoint& point, RandomStream& random, const Add& add) const
{
    each_light(point, random, [&](const Ray& ray, glm::vec3 white, const auto&, bool) { add(ray, white); });
}

template <typename Add>
void HitRadiance::direct(const SurfacePoint& point, const Bsdf& bsdf, glm::vec3 outgoing, RandomStream& random,
                         const Add& add) const
{
    SurfacePoint bent = point;
    bent.shading_normal = bsdf.normal;
    direct(bent, random, [&](const Ray& ray, glm::vec3 white) {
        add(ray, std::numbers::pi_v<float> * evaluate(bsdf, outgoing, ray.direction) * white, white);
    });
    const LobeSet behind = bsdf.those(is_diffuse_behind);
    if (behind == 0u) return;
    const glm::vec3 through = rcs::albedo(bsdf, outgoing, behind);
    direct(other_side(bent), random,
           [&](const Ray& ray, glm::vec3 white) { add(ray, through * white, glm::vec3(0.0f)); });
}

}  // namespace rcs
