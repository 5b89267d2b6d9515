#include "gbuffer/past_view.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "util/color.h"

namespace rcs {
namespace {

// The point and its normal as the four pixels have them in between may be off by so many footprints, and by so much.
constexpr float kSamePlace = 0.25f, kSameNormal = 0.05f;
// The surface between the four over what a pixel covers now: coarser pixels know too little.
constexpr float kMostCoarser = 2.0f;
// Light may lag behind what the viewer should see of it by this part, if a lobe's changes as much as it is while the
// viewer turns by the lobe's width...
constexpr float kLag = 0.01f;
// ... and be that of so many views.
constexpr int kMostViews = 16;
// ... or of so many where some of the four saw other surfaces: light that stays beside an edge moves along with it.
constexpr int kMostViewsInPart = 4;
// One by itself may be that much farther off, and turned by more: what lies between them is not averaged.
constexpr float kApart = 2.0f, kTurned = 2.0f * kSameNormal;
// Range of light over what there is to see, and over its error: four of the same light differ by 2.06 errors in the
// mean, hardly ever by twice that. (Were that seldom, what is bright by chance would be left out.)
constexpr float kEven = 0.2f, kAsNoise = 4.0f;
// The same where there is no noise, and how far the light of the fourth may lie off the plane of the others'.
constexpr float kExactlyEven = 0.1f, kTwist = 0.02f;

float range_of(const std::array<glm::vec3, 4>& light)
{
    const glm::vec3 low = glm::min(glm::min(light[0], light[1]), glm::min(light[2], light[3]));
    const glm::vec3 high = glm::max(glm::max(light[0], light[1]), glm::max(light[2], light[3]));
    return largest(high - low);
}

float width_of(const Shading& shading, const GBuffer& g, std::size_t pixel)
{
    const Bsdf bsdf = shading.bsdf(g, pixel);
    return narrowest(bsdf, glossy_lobes(bsdf));
}

}  // namespace

PastPoints points_of(const GBuffer& g, const View& view)
{
    PastPoints points{view, g.camera_position, std::vector<glm::vec3>(g.size()), std::vector<glm::vec3>(g.size()),
                      g.instance};
    for (std::size_t i = 0; i < g.size(); ++i) points.position[i] = g.position(i), points.normal[i] = g.normal(i);
    return points;
}

/// Whether the four pixels saw the surface around the point. @param point  relative to the earlier camera
bool PastPlaces::fits(const GBuffer& g, std::size_t i, glm::vec3 point) const
{
    for (const std::size_t pixel : around(i))
        if (past_.instance[pixel] != g.instance[i]) return false;
    const std::array<std::size_t, 4> at = around(i);
    const glm::vec3 corner = past_.position[at[0]];
    const float area = glm::length(glm::cross(past_.position[at[1]] - corner, past_.position[at[2]] - corner));
    return area <= kMostCoarser * g.footprint[i] * g.footprint[i] &&
           glm::length(mean(past_.position, i) - point) <= kSamePlace * g.footprint[i] &&
           glm::length(mean(past_.normal, i) - g.normal(i)) <= kSameNormal;
}

/// Whether the nearest of the four saw the surface around the point. Those that did then stand for the others.
bool PastPlaces::fits_in_part(const GBuffer& g, std::size_t i, glm::vec3 point, PastPlace& place) const
{
    const bool perspective = past_.view.camera.projection == Projection::perspective;
    const float coarser = perspective ? coarser_ * glm::length(point) / glm::length(g.position(i)) : coarser_;
    if (!(coarser * coarser <= kMostCoarser)) return false;
    const std::array<std::size_t, 4> at = around(place);
    std::array<bool, 4> saw{};
    for (std::size_t k = 0; k < 4; ++k) {
        const glm::vec3 apart = past_.position[at[k]] - point;
        saw[k] = past_.instance[at[k]] == g.instance[i] &&
                 std::abs(glm::dot(apart, g.geometric_normal[i])) <= kSamePlace * g.footprint[i] &&
                 glm::length(apart) <= kApart * g.footprint[i] &&
                 glm::length(past_.normal[at[k]] - g.normal(i)) <= kTurned;
    }
    const std::size_t nearest = (place.x > 0.5f ? 1u : 0u) + (place.y > 0.5f ? 2u : 0u);
    // Had all of them, they would have been found to fit: they lie too far apart.
    if (!saw[nearest] || std::all_of(saw.begin(), saw.end(), std::identity())) return false;
    place.is_whole = false;
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t beside = k ^ 1u, below = k ^ 2u;
        place.taken[k] = static_cast<std::uint8_t>(saw[k] ? k : saw[beside] ? beside : saw[below] ? below : nearest);
    }
    return true;
}

PastPlace PastPlaces::project(glm::dvec3 point) const
{
    const View& view = past_.view;
    const std::optional<glm::dvec2> image = projection_.position(point);
    if (!image) return {};
    const glm::dvec2 at = *image - view.pixel_offset, corner = glm::floor(at);
    if (!(corner.x >= 0.0 && corner.y >= 0.0 && corner.x < view.width - 1 && corner.y < view.height - 1)) return {};
    return {static_cast<std::uint32_t>(corner.y) * static_cast<std::uint32_t>(width_) +
                static_cast<std::uint32_t>(corner.x),
            static_cast<float>(at.x - corner.x), static_cast<float>(at.y - corner.y)};
}

PastPlaces::PastPlaces(const PastPoints& past, const GBuffer& g, const View& view, const Shading& shading,
                       ThreadPool& pool)
    : past_(past),
      projection_(past.view),
      places_(g.size()),
      width_(static_cast<std::size_t>(past.view.width)),
      coarser_(static_cast<float>(image_plane(past.view).pixel / image_plane(view).pixel))
{
    const glm::dvec3 to_past = g.camera_position - past.camera_position;
    const auto find = [&](std::size_t i) {
        const glm::dvec3 point = glm::dvec3(g.position(i)) + to_past;
        PastPlace& place = places_[i];
        place = project(point);
        if (!place.is_seen()) return;
        if (!fits(g, i, glm::vec3(point)) && !fits_in_part(g, i, glm::vec3(point), place)) {
            place.first = GBuffer::kNone;
            return;
        }
        if (!shading.has_lobes()) return;
        const glm::vec3 outgoing = outgoing_from(past.view.camera, glm::vec3(point));
        place.turn = glm::length(outgoing - outgoing_at(g, view.camera, i)) / width_of(shading, g, i);
    };
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            if (g.covered(i)) find(i);
    });
}

int PastPlaces::views(std::size_t pixel, float part_of_lobes) const
{
    int views = places_[pixel].is_whole ? kMostViews : kMostViewsInPart;
    while (views > 1 && static_cast<float>(views) * places_[pixel].turn * part_of_lobes > kLag) views /= 2;
    return views;
}

bool is_even(const std::array<glm::vec3, 4>& light, float error, float beside)
{
    return range_of(light) <= std::max(kEven * beside, kAsNoise * error);
}

bool is_exactly_even(const std::array<glm::vec3, 4>& light, float beside)
{
    const glm::vec3 twist = glm::abs(light[0] - light[1] - light[2] + light[3]);
    return range_of(light) <= kExactlyEven * beside && largest(twist) <= kTwist * beside;
}

PastMix mix_of(float past, float now, float least)
{
    const float weight = std::max(least, past / (past + now));
    return {weight, (1.0f - weight) * (1.0f - weight) * past + weight * weight * now};
}

}  // namespace rcs
