#pragma once

#include "glossy/traced_lobes.h"

namespace rcs {

/// Lets a guide learn which lit points are seen from where narrow lobes would look at them.
void learn_along_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                       const Shading& shading, std::uint64_t seed, ThreadPool& pool, GatherGuide& guide);

/// Looks of a pixel at lit points, beside its rays, that leave less noise than as much time spent on rays.
struct WorthwhileLooks {
    int count = 0;         ///< 0: none do
    bool is_sure = false;  ///< as many pixels were asked as are to be: other views need not ask
};
/// Measured at some of the picture's pixels. @param options  with a guide
WorthwhileLooks worthwhile_looks(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer,
                                 const View& view, const Shading& shading, const LobeSettings& options,
                                 ThreadPool& pool);

}  // namespace rcs
