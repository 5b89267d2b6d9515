#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

#include "cells/cell_grid.h"
#include "cells/cell_table.h"
#include "cells/light_cache_impl.h"
#include "util/random.h"

namespace rcs {

/// Direct light of lamps and sky on the surfaces that gather rays meet, as the mean over each cell: where one shadow
/// ray a hit tells little, many for each cell tell all hits in it.
struct DirectCells {
    /// One of what arrives in a cell, which stands for all of it.
    struct Light {
        glm::vec3 irradiance{0.0f};  ///< of all [W m^-2]
        glm::vec3 to_light{0.0f};    ///< unit: where this comes from; 0: the cell is dark
    };
    /// So many for each cell: glossy surfaces tell where their light comes from. Half of them come from one half of the
    /// cell's samples, half from the other.
    static constexpr std::size_t kLights = 8;
    enum class Half { both, first, second };  ///< in use: how halves differ tells what noise cells have

    CellGrid grid;
    CellTable table;
    Half half = Half::both;
    std::vector<std::array<Light, kLights>> lights;  ///< by cell, each as likely to be the one taken

    /// Whether a cell's edges are small seen from so far away.
    bool serves(glm::vec3 position, float distance) const
    {
        constexpr float kDistance = 4.0f;  // edges
        return distance >= kDistance * grid.edge(grid.level(position));
    }
    /// Of a cell near by, which one by chance, as for cached_irradiance(); null: nobody has looked there.
    const Light* at(glm::vec3 position, glm::vec3 normal, RandomStream& random) const
    {
        return find(leaf_near(grid, position, normal, random), random);
    }
    /// The same in two steps: memory that the second reads is asked for by the first, and its light by the second.
    std::uint64_t begin(glm::vec3 position, glm::vec3 normal, RandomStream& random) const
    {
        const std::uint64_t leaf = leaf_near(grid, position, normal, random);
        table.prefetch(leaf);
        return leaf;
    }
    const Light* find(std::uint64_t leaf, RandomStream& random) const
    {
        const std::uint32_t number = table.find(leaf);
        if (number == CellTable::kNone) return nullptr;
        const float of_half = 0.5f * (random.next() + (half == Half::second ? 1.0f : 0.0f));
        const float at = half == Half::both ? 2.0f * of_half : of_half;
        const Light* const light = &lights[number][static_cast<std::size_t>(at * static_cast<float>(kLights))];
        __builtin_prefetch(light);
        return light;
    }
};

}  // namespace rcs
