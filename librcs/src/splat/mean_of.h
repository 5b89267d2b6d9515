#pragma once

#include <cstddef>

#include <glm/glm.hpp>

#include "rcs/splat.h"

namespace rcs {

/// What records say of a pixel that some reach [W m^-2].
inline glm::vec3 mean_of(const SplatBuffer& sums, std::size_t i)
{
    return glm::vec3(sums.weighted_r[i], sums.weighted_g[i], sums.weighted_b[i]) / sums.weight[i];
}

}  // namespace rcs
