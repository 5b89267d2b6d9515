#include "glossy/lobe_sharing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "glossy/traced_lobes.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kNeighbours = 16;

/// Rays' light weighted by a lobe: the weighted mean, and how uncertain that is.
struct WeightedLight {
    glm::vec3 sum{0.0f}, total{0.0f};                              // of weight times radiance, and of weights
    float squares = 0.0f, products = 0.0f, square_weights = 0.0f;  // on luminance: (w L)^2, w L w, w^2

    void add(glm::vec3 weight, glm::vec3 radiance)
    {
        const float w = luminance(weight), l = luminance(weight * radiance);
        sum += weight * radiance;
        total += weight;
        squares += l * l;
        products += l * w;
        square_weights += w * w;
    }
    /// Of sum over total, a ratio of two means.
    float error_of_ratio() const
    {
        const float w = luminance(total);
        if (!(w > 0.0f)) return 0.0f;
        const float ratio = luminance(sum) / w;
        return std::sqrt(std::max(0.0f, squares - 2.0f * ratio * products + ratio * ratio * square_weights)) / w;
    }
    /// The mean, of a lobe that reflects so much.
    LobeLight by(glm::vec3 albedo) const
    {
        LobeLight reflected{glm::vec3(0.0f), luminance(albedo) * error_of_ratio()};
        for (int c = 0; c < 3; ++c) reflected.radiance[c] = total[c] > 0.0f ? albedo[c] * sum[c] / total[c] : 0.0f;
        return reflected;
    }
    float error_of_mean(float count) const
    {
        const float mean = luminance(sum) / count;
        return std::sqrt(std::max(0.0f, squares / count - mean * mean) / count);
    }
};

}  // namespace

/// Harmonic mean over the pixel's own rays [m].
float LobeSharing::mean_distance(std::size_t pixel, const RayRing& ring) const
{
    float inverse = 0.0f, count = 0.0f;
    const LobeRay* const own = ring.of(pixel);
    for (std::size_t n = 0; n < ring.count(); ++n) {
        if (!(own[n].density > 0.0f)) continue;
        inverse += 1.0f / own[n].distance;
        count += 1.0f;
    }
    return inverse > 0.0f ? count / inverse : std::numeric_limits<float>::infinity();
}

float LobeSharing::narrowest_traced(std::size_t pixel) const
{
    float alpha = 1.0f;
    for (const Lobe& lobe : shading_.lobes_of(pixel))
        if (lit_by_rays(lobe)) alpha = std::min(alpha, lobe.alpha);
    return alpha;
}

/// Whether a neighbour lies on the same, about equally glossy surface: within the plane by the pixel's footprint.
bool LobeSharing::may_share(std::size_t pixel, std::size_t neighbour) const
{
    if (!g_.covered(neighbour) || !shading_.is_traced(neighbour)) return false;
    const float here = narrowest_traced(pixel), there = narrowest_traced(neighbour);
    const glm::vec3 offset = g_.position(neighbour) - g_.position(pixel);
    return glm::dot(g_.geometric_normal[pixel], g_.geometric_normal[neighbour]) > 0.9f &&
           std::abs(glm::dot(offset, g_.geometric_normal[pixel])) < 0.1f * glm::length(offset) + g_.footprint[pixel] &&
           there < 2.0f * here && here < 2.0f * there;
}

LobeLights LobeSharing::share(std::size_t pixel, const RayRing& ring) const
{
    const Bsdf bsdf = shading_.bsdf(g_, pixel);
    const LobeSet traced = bsdf.those(lit_by_rays);
    const bool looks_through = (traced & transmitting_lobes(bsdf) & ~lobes_lit_behind(bsdf)) != 0u;
    const glm::vec3 outgoing = outgoing_at(g_, view_.camera, pixel);
    const glm::vec3 position = g_.position(pixel);
    WeightedLight light, of_lamps;
    const auto add = [&](std::size_t from) {
        const LobeRay* const rays = ring.of(from);
        for (std::size_t n = 0; n < ring.count(); ++n) {
            const LobeRay& ray = rays[n];
            if (!(ray.density > 0.0f)) continue;
            glm::vec3 incoming = ray.target;
            float density = ray.density;
            if (std::isfinite(ray.distance)) {
                incoming = ray.target - position;
                const float d2 = glm::dot(incoming, incoming);
                incoming /= std::sqrt(d2);
                density *= d2 / (ray.distance * ray.distance);
            }
            const glm::vec3 weight =
                evaluate(bsdf, outgoing, incoming, traced) * (std::abs(glm::dot(bsdf.normal, incoming)) / density);
            light.add(weight, ray.radiance);
            if (ring.finds_lamps()) of_lamps.add(weight, ring.of_lamps(ray));
        }
    };
    add(pixel);
    // Beyond the width of the lobe where it hits, a neighbour sees other things.
    const float reach = std::min(static_cast<float>(RayRing::kMostReach),
                                 narrowest(bsdf, traced) * mean_distance(pixel, ring) / g_.footprint[pixel]);
    if (reach >= 1.0f && !looks_through) {
        const int x = static_cast<int>(pixel % static_cast<std::size_t>(g_.width));
        const int y = static_cast<int>(pixel / static_cast<std::size_t>(g_.width));
        const float turn =
            2.0f * std::numbers::pi_v<float> *
            to_unit_float(static_cast<std::uint32_t>(mix64(lobe_key(seed_, pixel_number(view_, pixel)) + 77)));
        for (int n = 0; n < kNeighbours; ++n) {
            // Vogel's spiral: even over the disc.
            const float radius = reach * std::sqrt((static_cast<float>(n) + 0.5f) / kNeighbours);
            const float angle = turn + 2.3999632f * static_cast<float>(n);
            const int nx = x + static_cast<int>(std::lround(radius * std::cos(angle)));
            const int ny = y + static_cast<int>(std::lround(radius * std::sin(angle)));
            if (nx < 0 || ny < 0 || nx >= g_.width || ny >= g_.height || (nx == x && ny == y)) continue;
            const std::size_t neighbour =
                static_cast<std::size_t>(ny) * static_cast<std::size_t>(g_.width) + static_cast<std::size_t>(nx);
            if (may_share(pixel, neighbour)) add(neighbour);
        }
    }
    const glm::vec3 whole = albedo(bsdf, outgoing, traced);
    const auto light_of = [&](const WeightedLight& found) {
        const float count = static_cast<float>(ring.count());
        return looks_through ? LobeLight{found.sum / count, found.error_of_mean(count)} : found.by(whole);
    };
    return {light_of(light), light_of(of_lamps)};
}

}  // namespace rcs
