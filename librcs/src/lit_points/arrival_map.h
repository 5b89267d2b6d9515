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
#include "util/basis.h"

namespace rcs {

class ThreadPool;

/// What one ray brought from a direction.
struct ArrivedRay {
    std::uint16_t bin;  ///< of ArrivalMap::bins_of()
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
    /// Of the unit directions x a.x + y a.y + z a.z, that is.
    static void bins_of(const Basis& axes, const float* x, const float* y, const float* z,
                        std::span<std::uint16_t> bins);

    /// Running sums of the bins' chances for a gather: root mean square of what their rays brought, times the cosine.
    void weigh(const LookCells& cells, glm::vec3 normal, std::span<float> sums) const;

    struct Choice {
        glm::vec3 direction;
        std::uint16_t bin;
    };
    /// @param at  in [0, the last sum)   @param bin  where to begin, at most that one's
    static Choice choose(std::span<const float> sums, float at, glm::vec2 u, std::size_t& bin);
    /// [1/sr]
    static float density(std::span<const float> sums, std::size_t bin);

    /// Not while others ask. What is known does not depend on the order.
    void learn(std::span<const Arrivals> gathers, std::span<const ArrivedRay> arrivals, ThreadPool& pool);

private:
    std::uint32_t row(std::uint64_t cell);
    void add_row();
    void count(std::size_t at, float light);

    CellGrid grid_;
    float unit_ = 1.0f;
    CellTable table_;
    // By row, one per bin; row 0 is everywhere.
    std::vector<std::uint64_t> exact_squares_;  // a sum that does not depend on the order
    std::vector<float> squares_, rays_;         // whole numbers up to 2^24 rays, enough for any chance
};

}  // namespace rcs
