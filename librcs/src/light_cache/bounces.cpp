#include "light_cache/bounces.h"

#include <algorithm>

#include "util/color.h"

namespace rcs {
namespace {

// The rest of the series is then below a thousandth for any albedo up to 0.95.
constexpr float kNothingNew = 1e-5f;

/// Means of the leaves below each coarser cell, in the leaves' order.
void average_parents(const BounceSystem& system, std::vector<glm::vec3>& irradiance, std::vector<float>& leaves)
{
    const std::size_t first = system.source.size();
    std::fill(irradiance.begin() + static_cast<std::ptrdiff_t>(first), irradiance.end(), glm::vec3(0.0f));
    std::fill(leaves.begin(), leaves.end(), 0.0f);
    for (const auto& [leaf, parent] : system.parents) {
        const std::size_t p = std::min<std::size_t>(parent, system.cells - 1);
        irradiance[p] += irradiance[leaf];
        leaves[p] += 1.0f;
    }
    for (std::size_t p = first; p < system.cells; ++p)
        if (leaves[p] > 0.0f) irradiance[p] /= leaves[p];
}

glm::vec3 arriving(const BounceSystem& system, std::size_t leaf, const std::vector<glm::vec3>& irradiance)
{
    glm::vec3 sum(0.0f);
    const Link* links = system.links.data() + leaf * CellRays::kRays;
    for (int i = 0; i < CellRays::kRays; ++i)
        if (links[i].cell != CellTable::kNone)
            sum += glm::vec3(links[i].reflectance[0], links[i].reflectance[1], links[i].reflectance[2]) *
                   irradiance[links[i].cell];
    return system.source[leaf] + sum * (1.0f / (65535.0f * CellRays::kRays));
}

}  // namespace

void iterate_bounces(const BounceSystem& system, int bounces, ThreadPool& pool, std::vector<glm::vec3>& irradiance,
                     std::vector<std::vector<glm::vec3>>& fewer)
{
    const std::size_t leaves = system.source.size();
    std::vector<float> counts(system.cells);
    std::copy(system.source.begin(), system.source.end(), irradiance.begin());
    average_parents(system, irradiance, counts);
    std::vector<glm::vec3> next(irradiance.size());
    for (int bounce = 2; bounce <= bounces; ++bounce) {
        const std::size_t k = static_cast<std::size_t>(bounces - bounce);
        if (k < fewer.size()) fewer[k] = irradiance;
        pool.parallel_for(leaves, 256, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t c = begin; c < end; ++c) next[c] = arriving(system, c, irradiance);
        });
        average_parents(system, next, counts);
        std::swap(irradiance, next);
        // The mean over all leaves is the last cell.
        if (luminance(irradiance.back() - next.back()) <= kNothingNew * luminance(irradiance.back())) break;
    }
}

}  // namespace rcs
