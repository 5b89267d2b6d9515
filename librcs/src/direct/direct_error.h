#pragma once

#include <cstdint>
#include <vector>

#include "direct/direct.h"

namespace rcs {

/// The pixels at which light is sampled twice: one in each square of kCheckedSide, by chance.
inline constexpr int kCheckedSide = 8;
std::vector<std::uint32_t> checked_pixels(const GBuffer& gbuffer, std::uint64_t seed);

/// One of them, and luminances by other samples, as many of them.
struct CheckedPixel {
    std::uint32_t pixel = 0;
    float irradiance = 0.0f, glossy = 0.0f;
};

/// Fills in the standard errors of `light` at all pixels, from how light that was sampled twice differs nearby.
void spread_errors(const std::vector<CheckedPixel>& checked, const GBuffer& gbuffer, DirectLightResult& light);

}  // namespace rcs
