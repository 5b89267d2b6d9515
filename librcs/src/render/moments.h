#pragma once

#include <cmath>
#include <vector>

#include "gbuffer/views.h"
#include "rcs/render.h"

namespace rcs {

/// The passes of a picture seen through a camera, and their points of the lens.
inline std::vector<View> views_of(const Camera& camera, const RenderOptions& asked, int passes)
{
    std::vector<View> views = make_views(camera, asked.width, asked.height, passes);
    open_lens(asked, views);
    crop_views(asked, views);
    return views;
}

/// The moment of a pass: one after the other at even distances, or, where it is not known before how many there will
/// be, by the golden ratio, which fills the time for every number of them.
inline double part_of_shutter(const RenderOptions& asked, int pass)
{
    constexpr double kGolden = 0.6180339887498949;
    if (!has_goal(asked)) return (pass + 0.5) / asked.aa;
    const double part = 0.5 + kGolden * pass;
    return part - std::floor(part);
}

}  // namespace rcs
