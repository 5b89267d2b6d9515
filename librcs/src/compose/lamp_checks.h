#pragma once

#include <cstdint>

#include "hit_light/hit_radiance.h"
#include "rcs/camera.h"
#include "rcs/gbuffer.h"
#include "rcs/ray_scene.h"
#include "rcs/splat.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What lamp checks took.
struct LampChecks {
    std::uint64_t pixels = 0, shadow_rays = 0;
};

/// Where records disagree about the light of gathered lamps, at the edges of what sees them, a pixel asks the lamps
/// itself: shadow rays and the records' mean count by the inverse of their variances.
/// @param radiance  knows the gathered lamps, and who finds them
/// @param of_lamps  the records' sums of that light, with error sums; corrected   @param all  of all light; follows
LampChecks check_lamps(const RayScene& rays, const HitRadiance& radiance, const GBuffer& gbuffer, const View& view,
                       std::uint64_t seed, ThreadPool& pool, SplatBuffer& of_lamps, SplatBuffer& all);

}  // namespace rcs
