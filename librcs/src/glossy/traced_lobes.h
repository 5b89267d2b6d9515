#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "hit_light/hit_radiance.h"
#include "rcs/glossy_stats.h"
#include "rcs/thread_pool.h"

namespace rcs {

struct TracedLight {
    std::vector<glm::vec3> radiance;  ///< per pixel [W m^-2 sr^-1]; empty: none
    std::vector<float> error;         ///< standard error of its luminance, from how the rays differ
};

struct LobeSettings {
    int rays_per_pixel = 16;  ///< > 0
    int bounces = 1;          ///< surfaces after the visible point that reflect; >= 0
    std::uint64_t seed = 1;
};

/// Indirect light that narrow lobes reflect at every visible point: a few rays a pixel along the lobe (LobePaths),
/// shared between neighbours (LobeSharing). Emission of what these rays meet first does not count: the direct light has
/// it.
TracedLight trace_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                        const Shading& shading, const LobeSettings& options, ThreadPool& pool, GlossyStats& stats);

}  // namespace rcs
