#include "placement/view_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace rcs {
namespace {

// A visible point this near is on the record's surface [footprints]: the next sample lies within that on all but
// grazing ones.
constexpr float kNear = 2.0f;
// Footprints of a surface that faces the viewer; of one that does not they are larger, here by as much at the most.
constexpr double kOblique = 2.0;

/// The pixel whose sample lies next to a point, given relative to the camera; none outside of the picture.
std::optional<std::size_t> pixel_at(const View& view, glm::dvec3 relative)
{
    const std::optional<glm::dvec2> position = image_position(view, relative);
    if (!position) return std::nullopt;
    const glm::dvec2 at = glm::round(*position - view.pixel_offset);
    if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < view.width && at.y < view.height)) return std::nullopt;
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(at.x);
}

}  // namespace

void fit_to_view(const GBuffer& gbuffer, const View& view, std::span<Record> records)
{
    const bool perspective = view.camera.projection == Projection::perspective;
    const double pixel = image_plane(view).pixel;
    for (Record& r : records) {
        const glm::dvec3 relative = glm::dvec3(r.position) - gbuffer.camera_position;
        const std::optional<std::size_t> i = pixel_at(view, relative);
        if (i && gbuffer.covered(*i) &&
            glm::distance(glm::vec3(relative), gbuffer.position(*i)) <= kNear * gbuffer.footprint[*i]) {
            r.footprint = gbuffer.footprint[*i];
            continue;
        }
        const double facing =
            perspective ? pixel * std::max(glm::length(relative), static_cast<double>(r.footprint)) : pixel;
        r.footprint = std::min(r.footprint, static_cast<float>(kOblique * facing));
    }
}

}  // namespace rcs
