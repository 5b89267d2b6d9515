#pragma once

#include <cmath>
#include <vector>

#include "rcs/camera.h"

namespace rcs {

/// Where pass i of n samples the pixel: its centre if there is one pass, else the first n points of the
/// R2 sequence (Roberts 2018), which fill the square evenly for every n.
inline glm::dvec2 pixel_offset(int pass, int passes)
{
    if (passes == 1) return {0.5, 0.5};
    const auto wrap = [](double x) { return x - std::floor(x); };
    return {wrap(0.5 + 0.7548776662466927 * pass), wrap(0.5 + 0.5698402909980532 * pass)};
}

/// The passes of a picture of so many pixels.
inline std::vector<View> make_views(const Camera& camera, int width, int height, int passes)
{
    std::vector<View> views;
    for (int pass = 0; pass < passes; ++pass) views.push_back({camera, width, height, pixel_offset(pass, passes)});
    return views;
}

/// Across a smooth pixel, whose samples are alike, light strays from even growth by at most this part of it.
inline constexpr double kSmooth = 1.0 / 64.0;

}  // namespace rcs
