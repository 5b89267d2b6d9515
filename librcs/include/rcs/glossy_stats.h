#pragma once

#include <cstdint>

namespace rcs {

/// Rays along lobes that are too narrow for records.
struct GlossyStats {
    std::uint64_t rays = 0;         ///< along lobes
    std::uint64_t shadow_rays = 0;  ///< from what those met to lamps
    std::uint64_t looks = 0;        ///< shadow rays to lit points
};

}  // namespace rcs
