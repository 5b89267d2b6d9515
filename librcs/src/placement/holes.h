#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// The coarsest grid of candidates [px]: about the widest spacing of default options.
inline constexpr int kCoarsestStride = 32;

/// One wave: in each cell of a grid, one pixel by rule.
struct Wave {
    int stride;
    int phase;     ///< which quarter of the cells, so that neighbours do not both claim a hole; -1 takes all
    bool refresh;  ///< first let new records take reach from older ones, and see what that uncovers
};
/// From coarse grids to the pixels.
std::vector<Wave> waves();

/// The visible points of this wave's grid that no record serves, row of cells by row of cells.
/// @param corner  of the G-buffer in the whole picture, whose grid it is [px]
/// @param weight  per pixel, of the records: > 0 where one serves
std::vector<std::uint32_t> find_holes(const GBuffer& g, glm::ivec2 corner, const std::vector<float>& weight, Wave wave,
                                      std::uint64_t seed, ThreadPool& pool);

}  // namespace rcs
