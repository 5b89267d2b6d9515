#pragma once

#include <cstdint>

namespace rcs {

/// Rays along lobes that are too narrow for records.
struct GlossyStats {
    std::uint64_t rays = 0, shadow_rays = 0;
};

}  // namespace rcs
