#include "glossy/lobe_reach.h"

#include <algorithm>

#include <glm/glm.hpp>

#include "gbuffer/visible_points.h"
#include "glossy/lobe_rays.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Of half vectors, over the width of a lobe. Noise of cornell-animated's metal at 1, 1.5, 2, 3 and any: 25, 23, 23, 25
// and 32 %; a look of a neighbour whose lobe was elsewhere made five pixels of one seed 50 to 140 times too bright.
constexpr float kMostTurn = 1.5f;

/// How far the normals around a pixel turn, as half vectors of one and the same ray do between their lobes [rad/px].
float turn_per_pixel(const GBuffer& g, const Shading& shading, std::size_t pixel)
{
    constexpr int kStep = 2;  // px
    const int x = static_cast<int>(pixel % static_cast<std::size_t>(g.width));
    const int y = static_cast<int>(pixel / static_cast<std::size_t>(g.width));
    float turn = 0.0f, count = 0.0f;
    for (const glm::ivec2 step : {glm::ivec2(kStep, 0), {-kStep, 0}, {0, kStep}, {0, -kStep}}) {
        const glm::ivec2 at = glm::ivec2(x, y) + step;
        if (at.x < 0 || at.y < 0 || at.x >= g.width || at.y >= g.height) continue;
        const std::size_t neighbour =
            static_cast<std::size_t>(at.y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(at.x);
        if (!may_share(g, shading, pixel, neighbour)) continue;
        turn += glm::length(g.normal(neighbour) - g.normal(pixel)) / kStep;
        count += 1.0f;
    }
    return count > 0.0f ? turn / count : 0.0f;
}

}  // namespace

bool looks_through(const Bsdf& bsdf)
{
    return (bsdf.those(lit_by_rays) & transmitting_lobes(bsdf) & ~lobes_lit_behind(bsdf)) != 0u;
}

bool may_share(const GBuffer& g, const Shading& shading, std::size_t pixel, std::size_t neighbour)
{
    const float here = shading.traced[pixel], there = shading.traced[neighbour];
    return there >= 0.0f && there < 2.0f * here && here < 2.0f * there && g.covered(neighbour) &&
           lies_beside(g, pixel, neighbour);
}

float most_reach(const GBuffer& g, const Shading& shading, std::size_t pixel, float alpha)
{
    const float turn = turn_per_pixel(g, shading, pixel);
    return std::min(static_cast<float>(RayRing::kMostReach), kMostTurn * alpha / std::max(turn, 1e-6f));
}

float part_above_face(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes, std::uint64_t key)
{
    constexpr int kDirections = 32;
    constexpr float kEven = 0.9999f;  // cosine
    if (glm::dot(bsdf.normal, bsdf.geometric_normal) > kEven) return 1.0f;
    Bsdf whole = bsdf;
    whole.geometric_normal = bsdf.normal;
    const SeenLobes seen(whole, outgoing, lobes);
    RandomStream random(key);
    float all = 0.0f, above = 0.0f;
    for (int n = 0; n < kDirections; ++n) {
        const float choice = random.next(), along = (static_cast<float>(n) + random.next()) / kDirections;
        const BsdfSample sample = seen.sample(choice, {along, random.next()});
        const float weight = luminance(sample.weight);
        const bool is_found =
            glm::dot(bsdf.normal, sample.incoming) * glm::dot(bsdf.geometric_normal, sample.incoming) > 0.0f;
        all += weight;
        above += is_found ? weight : 0.0f;
    }
    return all > 0.0f ? above / all : 1.0f;
}

}  // namespace rcs
