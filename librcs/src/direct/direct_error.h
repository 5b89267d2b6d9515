#pragma once

#include <cstdint>
#include <vector>

#include "direct/direct.h"

namespace rcs {

/// A pixel at which light is sampled twice, and luminances by other samples, as many of them.
struct CheckedPixel {
    std::uint32_t pixel = GBuffer::kNone;
    float irradiance = 0.0f, glossy = 0.0f;
};

/// Fills in the standard errors of `light` at all pixels, from how light that was sampled twice differs nearby.
void spread_errors(const std::vector<CheckedPixel>& checked, const GBuffer& gbuffer, DirectLightResult& light);

}  // namespace rcs
