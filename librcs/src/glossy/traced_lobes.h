#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "cells/direct_cells.h"
#include "gbuffer/past_view.h"
#include "gbuffer/shading.h"
#include "hit_light/hit_radiance.h"
#include "lamps/gathered_lamps.h"
#include "lit_points/gather_guide.h"
#include "rcs/glossy_stats.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What a pixel's lobes reflect, by rays of its own that no neighbour shares.
struct TracedAgain {
    std::uint32_t pixel = GBuffer::kNone;
    glm::vec3 radiance[2] = {}, of_lamps[2] = {};  ///< independent of each other and of the picture's
};

struct TracedLight {
    std::vector<glm::vec3> radiance;       ///< per pixel [W m^-2 sr^-1]; empty: none
    std::vector<float> error;              ///< standard error of its luminance, from how the rays differ
    std::vector<glm::vec3> of_lamps = {};  ///< the same of gathered lamps, which the direct light leaves to these rays;
                                           ///< empty: of none
    std::vector<float> of_lamps_error = {};
    std::vector<TracedAgain> again = {};  ///< of the squares of CheckedPixels; empty where nobody asked
    std::vector<float> variance = {};     ///< over that of one view's rays; empty: 1, nothing of earlier views is in it
    std::vector<float> distance = {};     ///< harmonic mean of the rays' lengths [m]
    std::vector<glm::vec3> reflectance = {};  ///< albedo of the lobes towards the viewer
    std::vector<float> width = {};            ///< of the narrowest of them
    /// What each pixel found, before it was put together with what those around found; empty where it is not.
    struct Apart {
        std::vector<glm::vec3> radiance = {};
        std::vector<float> error = {};
        std::vector<glm::vec3> of_lamps = {};
        std::vector<float> of_lamps_error = {};
    } apart = {};
};

/// What an earlier view of the same scene saw along the same lobes.
struct PastTraced {
    const PastPlaces& places;
    const TracedLight& light;
    const std::vector<float>& all;  ///< per pixel, about what there is to see of all that is sampled (KeptSamples)
};

struct LobeSettings {
    int rays_per_pixel = 16;  ///< > 0
    int bounces = 1;          ///< surfaces after the visible point that reflect; >= 0
    std::uint64_t seed = 1;
    std::optional<std::uint64_t> checked = std::nullopt;  ///< of which pixels are traced twice more; none: of none
    const GatheredLamps* gathered = nullptr;              ///< null: none
    const GatherGuide* guide = nullptr;                   ///< to lit points that are looked at; null: none
    int looks_per_pixel = 0;                              ///< at those, beside the rays; needs a guide if > 0
    const DirectCells* direct = nullptr;                  ///< what is known of the light where rays end; null: nothing
    const PastTraced* past = nullptr;                     ///< null: each pixel has all of its rays
    const std::vector<std::uint8_t>* only = nullptr;      ///< per pixel, 0: it is left out; null: none is

    bool takes(std::size_t pixel) const { return !only || (*only)[pixel] != 0; }
};

/// Indirect light that narrow lobes reflect at every visible point: a few rays a pixel along the lobe (LobePaths),
/// and looks at lit points (LobeLooks), shared between neighbours (LobeSharing). Emission of what these rays meet first
/// does not count, since the direct light has it, but for that of gathered lamps.
TracedLight trace_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                        const Shading& shading, const LobeSettings& options, ThreadPool& pool, GlossyStats& stats);

}  // namespace rcs
