#pragma once

#include <vector>

#include "radiance/harmonics.h"
#include "rays/packet.h"

namespace rcs {

/// Radiance that rays bring from their directions, summed up in spherical harmonics (Record::radiance).
class RadianceSums {
public:
    void clear();

    /// @param red, green, blue  of the packet's 16 rays [W m^-2 sr^-1]; 0 for those that do not count
    void add(const RayPacket& ray, const float* red, const float* green, const float* blue);

    /// 36 coefficients of red, of green, of blue. @param weight  of one ray
    std::vector<float> coefficients(float weight) const;

private:
    static_assert(RayPacket::kWidth == kHarmonicLanes);
    HarmonicLanes lanes_[3];  // lane by lane, so that no sum crosses lanes before the end
};

}  // namespace rcs
