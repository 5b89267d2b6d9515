#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "light/hit_radiance.h"
#include "radiance/lobes.h"
#include "rcs/render.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// The lobes of a surface that are too narrow for records: the specular one below kLeastRecordAlpha, the coat,
/// rough transmission.
Bsdf traced_part(const Bsdf& bsdf);
inline bool has_traced_part(const Bsdf& bsdf)
{
    return (bsdf.has_specular() && !lit_by_records(bsdf)) || bsdf.has_coat() || bsdf.transmits();
}

struct TracedLight {
    std::vector<glm::vec3> radiance;  ///< per pixel [W m^-2 sr^-1]; empty: none
    std::vector<float> error;         ///< standard error of its luminance, from how the rays differ
};

/// Indirect light that narrow lobes reflect at every visible point: a few rays a pixel along the lobe, each hit lit
/// by lamps and, beyond one bounce, by the light cache. Emission of what the rays meet does not count: the direct
/// light has it.
///
/// Rays are shared between neighbours on the same surface (Stachowiak 2015, "Stochastic screen-space reflections"):
/// a pixel weighs every neighbour's hit point by its own lobe over the density with which the neighbour chose it,
/// and divides by the sum of weights. Lobes much narrower than what neighbours see in common share nothing, so a
/// mirror stays sharp.
/// @param rays_per_pixel  > 0
TracedLight trace_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                        const Shading& shading, int rays_per_pixel, std::uint64_t seed, ThreadPool& pool,
                        GlossyStats& stats);

}  // namespace rcs
