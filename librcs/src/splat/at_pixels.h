#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rcs/splat.h"

namespace rcs {

/// Sums over the records at some pixels, in the order in which these were given.
struct PixelSums {
    std::vector<glm::vec3> weighted;  ///< sum w_k E_k(p, n) [W m^-2]
    std::vector<float> weight;        ///< sum w_k
    /// As SplatBuffer has them; empty without SplatSettings::error_sums.
    std::vector<float> squares, variance, variance_of_sum;
    float luminance_unit = 1.0f;
};

/// What splat_tiles() has at `pixels`, to the bit, without the cost of all others: records are judged where they lie,
/// and that is one pixel of many. @param pixels  of the image, row by row from the top left; any order, twice as well
PixelSums splat_at_pixels(std::span<const Record> records, const GBuffer& gbuffer,
                          std::span<const std::uint32_t> pixels, const View& view, const SplatSettings& options,
                          ThreadPool& pool);

}  // namespace rcs
