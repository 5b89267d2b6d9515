#pragma once

#include "hit_light/hit_light.h"

namespace rcs {

/// Finds the light of gathered lamps at any place by what is known of who sees it. It brings part of that light, the
/// rest is left to samples that know nothing.
class LampFinder {
public:
    virtual ~LampFinder() = default;

    /// One shadow ray that is likely to be free; irradiance 0: there is nothing to shoot.
    virtual HitLights::Sample sample(const SurfacePoint& point, RandomStream& random) const = 0;
    /// Part of what a sample of HitLights brings that is left to it, in [0, 1]. @param lamp  the sample's triangle
    virtual float part_left(const SurfacePoint& point, const HitLights::Sample& sample,
                            const EmissiveTriangle& lamp) const = 0;
};

}  // namespace rcs
