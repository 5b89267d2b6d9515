#include "gbuffer/past_view.h"

#include <algorithm>
#include <optional>

namespace rcs {
namespace {

// The point and its normal as the four pixels have them in between may be off by so many footprints, and by so much.
constexpr float kSamePlace = 0.25f, kSameNormal = 0.05f;
// Light may lag behind what the viewer should see of it by this part, if a lobe's changes as much as it is while the
// viewer turns by the lobe's width...
constexpr float kLag = 0.01f;
// ... and be that of so many views.
constexpr int kMostViews = 16;
// Range of light over what there is to see, and over its error: four of the same light differ by 2.06 errors in the
// mean.
constexpr float kEven = 0.2f, kAsNoise = 2.5f;

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
bool PastPlaces::fits(const PastPoints& past, const GBuffer& g, std::size_t i, glm::vec3 point) const
{
    for (const std::size_t pixel : around(i))
        if (past.instance[pixel] != g.instance[i]) return false;
    return glm::length(mean(past.position, i) - point) <= kSamePlace * g.footprint[i] &&
           glm::length(mean(past.normal, i) - g.normal(i)) <= kSameNormal;
}

PastPlaces::PastPlaces(const PastPoints& past, const GBuffer& g, const View& view, const Shading& shading,
                       ThreadPool& pool)
    : places_(g.size()), width_(static_cast<std::size_t>(past.view.width))
{
    const glm::dvec3 to_past = g.camera_position - past.camera_position;
    const auto find = [&](std::size_t i) {
        const glm::dvec3 point = glm::dvec3(g.position(i)) + to_past;
        const std::optional<glm::dvec2> image = image_position(past.view, point);
        if (!image) return;
        const glm::dvec2 at = *image - past.view.pixel_offset, corner = glm::floor(at);
        if (!(corner.x >= 0.0 && corner.y >= 0.0 && corner.x < past.view.width - 1 && corner.y < past.view.height - 1))
            return;
        PastPlace& place = places_[i];
        place = {static_cast<std::uint32_t>(corner.y) * static_cast<std::uint32_t>(width_) +
                     static_cast<std::uint32_t>(corner.x),
                 static_cast<float>(at.x - corner.x), static_cast<float>(at.y - corner.y)};
        if (!fits(past, g, i, glm::vec3(point))) {
            place.first = GBuffer::kNone;
            return;
        }
        if (!shading.has_lobes()) return;
        const bool parallel = past.view.camera.projection == Projection::orthographic;
        const glm::vec3 outgoing = parallel ? parallel_outgoing(past.view.camera) : -glm::vec3(glm::normalize(point));
        place.turn = glm::length(outgoing - outgoing_at(g, view.camera, i)) / width_of(shading, g, i);
    };
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            if (g.covered(i)) find(i);
    });
}

int PastPlaces::views(std::size_t pixel, float part_of_lobes) const
{
    int views = kMostViews;
    while (views > 1 && static_cast<float>(views) * places_[pixel].turn * part_of_lobes > kLag) views /= 2;
    return views;
}

bool is_even(const std::array<float, 4>& light, float error, float beside)
{
    const auto [low, high] = std::minmax_element(light.begin(), light.end());
    return *high - *low <= std::max(kEven * beside, kAsNoise * error);
}

PastMix mix_of(float past, float now, float least)
{
    const float weight = std::max(least, past / (past + now));
    return {weight, (1.0f - weight) * (1.0f - weight) * past + weight * weight * now};
}

}  // namespace rcs
