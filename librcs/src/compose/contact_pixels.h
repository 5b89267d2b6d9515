#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A pixel that records around it know too little of.
struct PixelAtContact {
    std::uint32_t pixel;
    glm::ivec2 to;  ///< the other surface that rises from its own [px], 1 or 2 away; 0: it lies alone
};
/// Of a step over the image [px].
inline int pixels_away(glm::ivec2 step) { return std::max(std::abs(step.x), std::abs(step.y)); }

/// What a further pass, which leaves out even pixels that are known, has of the first one.
struct FirstContacts {
    std::span<const PixelAtContact> pixels;  ///< where surfaces meet in that, they do in this one as well
    std::span<const std::uint8_t> left_out;  ///< 1: the pixel is
};
/// Pixels closer to another surface than any record lies to the next: records beside reach over them, agree, and know
/// nothing of the light that it takes away there. And those that lie alone, with hardly a neighbour on their own
/// surface: leaves, twigs and folds a pixel wide, where records say what others are lit by. @return row by row
/// @param first  null: no pixel is left out
std::vector<PixelAtContact> pixels_at_contacts(const GBuffer& gbuffer, ThreadPool& pool,
                                               const FirstContacts* first = nullptr);

/// Calls visit(pixel, columns, rows) for the pixels in a window of the image around one.
template <typename Visit>
void for_each_around(const GBuffer& g, std::size_t pixel, int reach, const Visit& visit)
{
    const int x = static_cast<int>(pixel % static_cast<std::size_t>(g.width));
    const int y = static_cast<int>(pixel / static_cast<std::size_t>(g.width));
    for (int row = std::max(0, y - reach); row <= std::min(g.height - 1, y + reach); ++row)
        for (int column = std::max(0, x - reach); column <= std::min(g.width - 1, x + reach); ++column)
            visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(column),
                  column - x, row - y);
}

}  // namespace rcs
