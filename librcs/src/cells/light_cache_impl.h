#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "cells/cell_grid.h"
#include "cells/cell_table.h"
#include "rcs/light_cache.h"
#include "util/basis.h"
#include "util/random.h"

namespace rcs {

/// Cells and what they receive: leaves, then the coarser cells that average over them, then one for all of the scene.
struct LightCache::Impl {
    CellGrid grid;
    CellTable table;
    std::vector<glm::vec3> irradiance;          ///< by number [W m^-2]; the last one is the mean of all leaves
    int bounces = 0;                            ///< reflections on the way to a cell
    std::vector<std::vector<glm::vec3>> fewer;  ///< [k]: after k + 1 bounces fewer; empty: as after all of them

    /// Irradiance after so many bounces fewer, or after the fewest that are kept; null: 0.
    const std::vector<glm::vec3>* after(int fewer_bounces) const
    {
        if (fewer_bounces >= bounces) return nullptr;
        const int kept = std::min(fewer_bounces, static_cast<int>(fewer.size()));
        return kept == 0 || fewer[static_cast<std::size_t>(kept - 1)].empty()
                   ? &irradiance
                   : &fewer[static_cast<std::size_t>(kept - 1)];
    }

    /// The number of a cell, or of the finest one around it that there is.
    std::uint32_t find(std::uint64_t cell) const
    {
        for (;;) {
            const std::uint32_t number = table.find(cell);
            if (number != CellTable::kNone) return number;
            if (CellGrid::level_of(cell) + 1 == CellGrid::kLevels)
                return static_cast<std::uint32_t>(irradiance.size() - 1);
            cell = CellGrid::parent(cell);
        }
    }
};

/// The leaf at a place near the given one, at random up to half an edge away along the surface: the expectation of what
/// it holds is linear between the middles of cells, and no edge of a cell shows.
inline std::uint64_t leaf_near(const CellGrid& grid, glm::vec3 position, glm::vec3 normal, RandomStream& random)
{
    const int level = grid.level(position);
    const Basis basis(normal);
    const float edge = grid.edge(level);
    const float u = edge * (random.next() - 0.5f), v = edge * (random.next() - 0.5f);
    return grid.leaf(position + u * basis.x + v * basis.y, normal, level);
}

/// Irradiance at a surface from light that has been reflected at other surfaces [W m^-2]; noisy by the choice of the
/// cell.
/// @param fewer  bounces to leave out of those that the cache has
inline glm::vec3 cached_irradiance(const LightCache& cache, glm::vec3 position, glm::vec3 normal, RandomStream& random,
                                   int fewer = 0)
{
    const LightCache::Impl& c = cache.impl();
    const std::vector<glm::vec3>* const irradiance = c.after(fewer);
    return irradiance ? (*irradiance)[c.find(leaf_near(c.grid, position, normal, random))] : glm::vec3(0.0f);
}

}  // namespace rcs
