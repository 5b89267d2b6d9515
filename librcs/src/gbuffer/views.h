#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "rcs/camera.h"
#include "rcs/render_options.h"
#include "scene/camera_rays.h"
#include "scene/lens.h"

namespace rcs {

/// Where pass i of n samples the pixel: its centre if there is one pass, else the first n points of the
/// R2 sequence (Roberts 2018), which fill the square evenly for every n. In steps of 2^-24, so that sums with the
/// numbers of pixels are exact, and a part of a picture has its samples.
inline glm::dvec2 pixel_offset(int pass, int passes)
{
    if (passes == 1) return {0.5, 0.5};
    const auto wrap = [](double x) { return std::floor((x - std::floor(x)) * 0x1p24) * 0x1p-24; };
    return {wrap(0.5 + 0.7548776662466927 * pass), wrap(0.5 + 0.5698402909980532 * pass)};
}

/// The passes of a picture of so many pixels.
inline std::vector<View> make_views(const Camera& camera, int width, int height, int passes)
{
    std::vector<View> views;
    for (int pass = 0; pass < passes; ++pass) views.push_back({camera, width, height, pixel_offset(pass, passes)});
    return views;
}

/// Makes each pass look through its own point of the lens, if there is one.
inline void open_lens(const RenderOptions& options, std::vector<View>& views)
{
    if (!options.f_stop || views.size() < 2) return;
    const Camera middle = views.front().camera;
    const Lens lens = lens_of(middle, *options.f_stop, *options.focus);
    for (std::size_t i = 0; i < views.size(); ++i)
        views[i].camera = through_lens(middle, lens, lens_point(static_cast<int>(i)));
}

/// Parts of pictures begin at such pixels, so that placement finds the cells there that it has in the whole.
inline constexpr int kPartGrid = 32;

/// Makes views show the crop alone, with a margin as wide as neighbours say something about a pixel's light.
inline void crop_views(const RenderOptions& options, std::vector<View>& views)
{
    if (!options.crop) return;
    // Rays and samples are shared between pixels not as far from each other as records may reach at their coarsest.
    constexpr double kLeast = 16.0, kCoarsest = 0.25;
    const double tolerance = std::max<double>(settings_or_default(options).error_tolerance, kCoarsest);
    const double reach = tolerance * static_cast<double>(options.max_reach) * static_cast<double>(options.overlap);
    const glm::ivec2 whole(options.width, options.height);
    const int margin = static_cast<int>(std::clamp(std::ceil(reach), kLeast, 16384.0));
    const glm::ivec2 corner(options.crop->x, options.crop->y);
    const glm::ivec2 end = corner + glm::ivec2(options.crop->width, options.crop->height);
    const glm::ivec2 from = glm::max(corner - margin, 0) / kPartGrid * kPartGrid;
    const glm::ivec2 size = glm::min(end + margin, whole) - from;
    for (View& view : views) {
        view.width = size.x, view.height = size.y;
        view.corner = from, view.whole = whole;
    }
}

/// The pixel whose sample lies next to a point, given relative to the camera; none outside of the picture.
/// @param projection  of the view
inline std::optional<std::size_t> pixel_at(const View& view, const ImageProjection& projection, glm::dvec3 relative)
{
    const std::optional<glm::dvec2> position = projection.position(relative);
    if (!position) return std::nullopt;
    const glm::dvec2 at = glm::round(*position - view.pixel_offset);
    if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < view.width && at.y < view.height)) return std::nullopt;
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(at.x);
}

/// Across a smooth pixel, whose samples are alike, light strays from even growth by at most this part of it.
inline constexpr double kSmooth = 1.0 / 64.0;

}  // namespace rcs
