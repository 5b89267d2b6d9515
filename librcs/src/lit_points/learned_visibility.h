#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "cells/cell_grid.h"
#include "cells/cell_table.h"
#include "lit_points/light_clusters.h"

namespace rcs {

/// The cells around a place that are told apart in what is learned, the finer one first.
using LookCells = std::array<std::uint64_t, 2>;

/// What became of a shadow ray from a place to a point of a cluster.
struct Look {
    LookCells cells;  ///< of the place
    std::uint16_t cluster;
    bool free;
};

LookCells look_cells(const CellGrid& grid, glm::vec3 position, glm::vec3 normal);

/// Which clusters are seen from where, as earlier looks from about there found.
class LearnedVisibility {
public:
    LearnedVisibility() = default;
    LearnedVisibility(const CellGrid& grid, std::size_t clusters);

    LookCells cells(glm::vec3 position, glm::vec3 normal) const { return look_cells(grid_, position, normal); }
    /// What was never seen may be seen after all.
    static constexpr float kLeastChance = 0.03f;
    /// The chance that a look is free, more or less. @param least  > 0   @param chances  room for one per cluster
    void estimate(const LookCells& cells, float least, float* chances) const;
    /// The same from anywhere.
    float chance(std::size_t cluster) const;
    /// Not while others estimate. What is known does not depend on the looks' order.
    void learn(std::span<const Look> looks);
    /// Counts what was learned by many looks half: things have moved since.
    void fade();

private:
    struct Counts {
        std::uint32_t looks = 0, free = 0;
    };
    std::uint32_t row(std::uint64_t cell);
    static void refine(const Counts* counts, std::size_t clusters, float* chances);

    CellGrid grid_;
    std::size_t clusters_ = 0;
    CellTable table_;
    std::vector<Counts> counts_;  // by row, one per cluster; row 0 is everywhere
};

}  // namespace rcs
