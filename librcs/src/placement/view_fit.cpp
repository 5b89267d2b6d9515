#include "placement/view_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>

#include "gbuffer/views.h"
#include "records/known_record.h"

namespace rcs {
namespace {

// A visible point this near is on the record's surface [footprints]: the next sample lies within that on all but
// grazing ones.
constexpr float kNear = 2.0f;
// A record's footprint differs from the pixel's by so many times at the most: it keeps its reach while the camera moves
// a little, and follows by little steps as it goes on, so that what it shows does not flicker (measured:
// docs/method.md, Views to come). In pictures of another size, and from a file, it has to fit, but for what samples of
// a pixel differ by: without that, a picture from its own records' file finds more holes.
constexpr float kSame = 1.25f, kSameInOtherPicture = 1.1f;
// Footprints of a surface that faces the viewer; of one that does not they are larger, here by as much at the most.
constexpr double kOblique = 2.0;

}  // namespace

double reach_in_pixels(const View& view, const Record& record, double length)
{
    const double pixel = image_plane(view).pixel;
    const bool perspective = view.camera.projection == Projection::perspective;
    const double distance = glm::length(glm::dvec3(record.position) - camera_position(view.camera));
    return length / std::min(static_cast<double>(record.footprint), perspective ? pixel * distance : pixel);
}

std::vector<Record> take_unseen(const View& view, std::vector<Record>& records)
{
    // What a record's splat covers, and so its neighbours': the widest overlap, and a little more.
    constexpr float kReach = 4.0f;
    const glm::dvec3 eye = camera_position(view.camera);
    const auto is_near = [&](const Record& r) {
        const glm::dvec3 relative = glm::dvec3(r.position) - eye;
        const double reach = static_cast<double>(kReach * r.spacing_radius);
        const std::optional<glm::dvec2> at = image_position(view, relative);
        if (!at) return glm::length(relative) <= reach;
        const double pixels = 1.0 + reach_in_pixels(view, r, reach);
        return at->x >= -pixels && at->y >= -pixels && at->x <= view.width + pixels && at->y <= view.height + pixels;
    };
    const auto unseen = std::stable_partition(records.begin(), records.end(), is_near);
    std::vector<Record> taken(std::make_move_iterator(unseen), std::make_move_iterator(records.end()));
    records.erase(unseen, records.end());
    return taken;
}

namespace {

/// The pixel that shows a record's place; none where nothing, or something else, is seen there.
std::optional<std::size_t> pixel_of(const GBuffer& gbuffer, const View& view, const Record& record)
{
    const glm::dvec3 relative = glm::dvec3(record.position) - gbuffer.camera_position;
    const std::optional<std::size_t> i = pixel_at(view, relative);
    if (!i || !gbuffer.covered(*i)) return std::nullopt;
    const bool is_near = glm::distance(glm::vec3(relative), gbuffer.position(*i)) <= kNear * gbuffer.footprint[*i];
    return is_near ? i : std::nullopt;
}

}  // namespace

void fit_to_view(const GBuffer& gbuffer, const View& view, bool of_such_pictures, std::span<Record> records)
{
    const float same = of_such_pictures ? kSame : kSameInOtherPicture;
    const bool perspective = view.camera.projection == Projection::perspective;
    const double pixel = image_plane(view).pixel;
    for (Record& r : records) {
        if (const std::optional<std::size_t> i = pixel_of(gbuffer, view, r)) {
            const float now = gbuffer.footprint[*i];
            r.footprint = std::clamp(r.footprint, now / same, now * same);
            continue;
        }
        const double distance = glm::length(glm::dvec3(r.position) - gbuffer.camera_position);
        const double facing = perspective ? pixel * std::max(distance, static_cast<double>(r.footprint)) : pixel;
        r.footprint = std::min(r.footprint, static_cast<float>(kOblique * facing));
    }
}

std::vector<std::uint32_t> bring_seen_last(const GBuffer& gbuffer, const View& view, bool with_radiance,
                                           std::vector<Record>& records)
{
    std::vector<std::uint32_t> pixels;
    std::vector<Record> seen;
    std::size_t others = 0;
    for (std::size_t k = 0; k < records.size(); ++k) {
        Record& r = records[k];
        const std::optional<std::size_t> i = pixel_of(gbuffer, view, r);
        if (i && is_born(r) && r.radiance.empty() != with_radiance) {
            pixels.push_back(static_cast<std::uint32_t>(*i));
            seen.push_back(std::move(r));
        } else {
            if (others != k) records[others] = std::move(r);
            ++others;
        }
    }
    records.resize(others);
    records.insert(records.end(), std::make_move_iterator(seen.begin()), std::make_move_iterator(seen.end()));
    return pixels;
}

}  // namespace rcs
