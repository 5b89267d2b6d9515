#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <glm/glm.hpp>

#include "util/color.h"

namespace rcs {

/// Moments of what the records say at one place of a splat, in units of its luminance.
struct Disagreement {
    float mean = 0.0f;
    float variance = 0.0f;  ///< of the mean, from noise
    float excess = 0.0f;    ///< of the records' spread over what noise explains; may be negative by chance

    /// Standard error by noise, relative to the mean, which is > 0.
    float noise() const { return std::sqrt(variance) / mean; }
    /// Relative variances, in [-1, 1]: a dark place says as much as a light one of how well the expansion works there.
    float relative_excess() const { return mean > 0.0f ? std::clamp(excess / (mean * mean), -1.0f, 1.0f) : 0.0f; }
};

/// Standard error by spread of which that is the relative excess. Measured against path-traced references of the shared
/// and built-in scenes (docs/accuracy.md): the spread of the extrapolations is somewhat more than the error of their
/// mean.
inline float error_of_spread(double relative_excess)
{
    constexpr float kErrorOfSpread = 0.5f;
    return kErrorOfSpread * static_cast<float>(std::sqrt(std::max(0.0, relative_excess)));
}

/// @param sums  of a splat with error sums   @param light  sum w E there [W m^-2]
template <typename Sums>
Disagreement disagreement(const Sums& sums, std::size_t i, glm::vec3 light)
{
    const float weight = sums.weight[i];
    if (!(weight > 0.0f)) return {};
    Disagreement d;
    d.mean = luminance(light) / (weight * sums.luminance_unit);
    d.variance = sums.variance_of_sum[i] / (weight * weight);
    const float spread = sums.squares[i] / weight - d.mean * d.mean;
    d.excess = spread - (sums.variance[i] / weight - d.variance);
    return d;
}

}  // namespace rcs
