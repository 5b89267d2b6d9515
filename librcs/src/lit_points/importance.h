#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "cells/cell_grid.h"
#include "cells/cell_table.h"

namespace rcs {

/// How densely lit points are wanted on surfaces: by what of them visible points see, and by how bright that is. Kept
/// in cells and in coarser ones around them, each of which stands in where a finer one knows too little.
class Importance {
public:
    explicit Importance(const CellGrid& grid) : grid_(grid) {}

    const CellGrid& grid() const { return grid_; }

    /// A surface that a visible point's ray has met.
    void note_seen(glm::vec3 position, glm::vec3 normal);
    /// Light that leaves a surface here, 0 or more: one of the samples that its mean is estimated from.
    void note_light(glm::vec3 position, glm::vec3 normal, float radiosity);
    /// Takes in what has been noted.
    void update();

    /// What is known of a surface's surroundings.
    struct Value {
        float seen = 0.0f;    ///< rays per area [m^-2]
        float bright = 0.0f;  ///< the same times the mean of the light
    };
    Value at(glm::vec3 position, glm::vec3 normal) const { return of(leaf(position, normal)); }
    /// The cell that a surface lies in, and what is known of a cell's surroundings.
    std::uint64_t leaf(glm::vec3 position, glm::vec3 normal) const { return leaf_at(grid_, position, normal); }
    Value of(std::uint64_t leaf) const;
    /// Asks for the memory that of() will read first.
    void prefetch(std::uint64_t leaf) const { table_.prefetch(leaf); }

private:
    struct Cell {
        std::uint64_t key;
        double seen = 0.0, light = 0.0, samples = 0.0;  // noted in it
        float brightness = 0.0f;
    };
    template <typename Add>
    void note(glm::vec3 position, glm::vec3 normal, const Add& add);

    CellGrid grid_;
    CellTable table_;
    std::vector<Cell> cells_;
    std::vector<Value> values_;  // one for each, by update()
};

}  // namespace rcs
