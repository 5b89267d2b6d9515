#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rays/surface.h"
#include "rcs/gbuffer.h"
#include "util/random.h"

namespace rcs {

/// What a covered pixel sees, as far as rays from there need it.
inline SurfacePoint visible_point(const GBuffer& g, std::size_t pixel)
{
    SurfacePoint p{};
    p.position = g.scene_position(pixel);
    p.position_error = g.position_error[pixel];
    p.geometric_normal = g.geometric_normal[pixel];
    p.shading_normal = g.normal(pixel);
    return p;
}

/// Calls visit(neighbour) for the pixels of the picture so far to either side of one, row by row, itself among them.
/// @param reach  [px]
template <typename Visit>
void for_each_near(const GBuffer& g, std::size_t pixel, int reach, const Visit& visit)
{
    const int x = static_cast<int>(pixel) % g.width, y = static_cast<int>(pixel) / g.width;
    for (int ny = std::max(0, y - reach); ny <= std::min(g.height - 1, y + reach); ++ny) {
        const std::size_t row = static_cast<std::size_t>(ny) * static_cast<std::size_t>(g.width);
        for (int nx = std::max(0, x - reach); nx <= std::min(g.width - 1, x + reach); ++nx)
            visit(row + static_cast<std::size_t>(nx));
    }
}

/// Whether a covered pixel close by lies on the same, about even surface: within the plane by the pixel's footprint.
inline bool lies_beside(const GBuffer& g, std::size_t pixel, std::size_t near)
{
    const glm::vec3 offset = g.position(near) - g.position(pixel), normal = g.geometric_normal[pixel];
    return glm::dot(normal, g.geometric_normal[near]) > 0.9f &&
           std::abs(glm::dot(offset, normal)) < 0.1f * glm::length(offset) + g.footprint[pixel];
}

/// Covered pixels evenly over the picture: one in each of `count` parts of it, fewer where nothing is seen.
inline std::vector<std::uint32_t> spread_pixels(const GBuffer& g, std::size_t count, std::uint64_t seed)
{
    std::vector<std::uint32_t> pixels;
    const double step = static_cast<double>(g.size()) / static_cast<double>(count);
    for (std::size_t k = 0; k < count; ++k) {
        RandomStream random(stream_key(seed, Stream::lit_points, k));
        const double at = (static_cast<double>(k) + static_cast<double>(random.next())) * step;
        const std::size_t i = std::min(g.size() - 1, static_cast<std::size_t>(at));
        if (g.covered(i)) pixels.push_back(static_cast<std::uint32_t>(i));
    }
    return pixels;
}

}  // namespace rcs
