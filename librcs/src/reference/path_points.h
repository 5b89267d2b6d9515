#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "reference/sobol.h"

namespace rcs {

/// The points of one path: pair n of the path is point `index` of the n-th padded Sobol' sequence.
struct PathPoints {
    std::uint32_t index = 0;
    std::uint64_t key = 0;

    glm::vec2 pair(int n) const { return sobol_pair(index, mix64(key ^ static_cast<std::uint64_t>(n))); }
};

}  // namespace rcs
