#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "cells/cell_table.h"
#include "light_cache/cell_rays.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What one ray of a cell says: which cell it looks at, and how much of that cell's irradiance comes back.
struct Link {
    std::uint32_t cell = CellTable::kNone;     ///< kNone: nothing was hit
    std::uint16_t reflectance[3] = {0, 0, 0};  ///< fractions of 65535
};
inline Link make_link(bool hit, glm::vec3 reflectance)
{
    const glm::vec3 code = glm::clamp(reflectance, 0.0f, 1.0f) * 65535.0f + 0.5f;
    Link link;
    link.cell = hit ? 0u : CellTable::kNone;
    for (int i = 0; i < 3; ++i) link.reflectance[i] = static_cast<std::uint16_t>(code[i]);
    return link;
}

/// The light transport between cells: radiosity (Goral et al. 1984) with a form factor of 1/64 for each ray.
struct BounceSystem {
    static constexpr std::uint32_t kTop = 0xffffffffu;  ///< stands for the last cell, above all others

    std::vector<glm::vec3> source;  ///< per leaf: irradiance from what reflects lamps and sky directly [W m^-2]
    std::vector<Link> links;        ///< leaf c has 64 from 64 c on
    std::vector<std::pair<std::uint32_t, std::uint32_t>> parents;  ///< (leaf, a coarser cell above it)
    std::size_t cells = 0;                                         ///< leaves first, the top last

    void resize_leaves(std::size_t count)
    {
        source.resize(count);
        links.resize(count * CellRays::kRays);
    }
};

/// E_1 = source, E_n = source + the links' mean of reflectance x E_(n-1): irradiance after n reflections of all cells,
/// in two buffers in turn. Ends early where further bounces change nothing that a float could tell.
/// @param bounces  n >= 1   @param irradiance  one per cell [W m^-2]
/// @param fewer  [k] becomes E_(n - 1 - k), or stays empty where that is E_n or, without a bounce, 0
void iterate_bounces(const BounceSystem& system, int bounces, ThreadPool& pool, std::vector<glm::vec3>& irradiance,
                     std::vector<std::vector<glm::vec3>>& fewer);

}  // namespace rcs
