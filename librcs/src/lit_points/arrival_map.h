#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "cells/cell_grid.h"
#include "cells/cell_table.h"
#include "lit_points/learned_visibility.h"

namespace rcs {

/// What one ray brought from a direction.
struct ArrivedRay {
    std::uint16_t bin;  ///< of ArrivalMap::bin_of()
    float light;        ///< luminance of radiance [W m^-2 sr^-1]
};

/// The rays of one gather.
struct Arrivals {
    LookCells cells;  ///< of the place
    std::uint32_t first, count;
};

/// From which directions light arrives where, as the rays of earlier gathers from about there found: gathers aim some
/// of their rays by it (after Mueller, Gross and Novak 2017). The sphere of directions is cut into bins of equal
/// solid angle, in scene space.
class ArrivalMap {
public:
    static constexpr int kRings = 24, kTurns = 48, kBins = kRings * kTurns;

    ArrivalMap() = default;
    /// @param unit  about how much a ray brings [W m^-2 sr^-1], > 0
    ArrivalMap(const CellGrid& grid, float unit);

    LookCells cells(glm::vec3 position, glm::vec3 normal) const { return look_cells(grid_, position, normal); }
    static std::uint16_t bin_of(glm::vec3 direction);

    /// Running sums of the bins' chances for a gather: root mean square of what their rays brought, times the cosine.
    void weigh(const LookCells& cells, glm::vec3 normal, std::span<float> sums) const;

    struct Choice {
        glm::vec3 direction;
        float density;  ///< [1/sr]
    };
    /// @param at  in [0, the last sum)   @param bin  where to begin, at most that one's
    static Choice choose(std::span<const float> sums, float at, glm::vec2 u, std::size_t& bin);
    static float density(std::span<const float> sums, glm::vec3 direction);

    /// Not while others ask. What is known does not depend on the order.
    void learn(std::span<const Arrivals> gathers, std::span<const ArrivedRay> arrivals);

private:
    struct Counts {
        std::uint64_t squares = 0;
        std::uint32_t rays = 0;
    };
    std::uint32_t row(std::uint64_t cell);

    CellGrid grid_;
    float unit_ = 1.0f;
    CellTable table_;
    std::vector<Counts> counts_;  // by row, one per bin; row 0 is everywhere
};

}  // namespace rcs
