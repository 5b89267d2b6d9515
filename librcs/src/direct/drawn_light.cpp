#include "direct/drawn_light.h"

#include <cstddef>
#include <utility>

#include "gbuffer/visible_points.h"
#include "util/noisy_window.h"

namespace rcs {
namespace {

// Pixels to either side that have a part in it.
constexpr int kReach = 2;
// Of the noise's variance: what pixels around make of it by chance may be more. With 1, 1.5, 2, 2.5 direct light of 96
// panels behind slats is off by 6.2, 5.2, 4.9, 4.7 %, and the more is lost of what is no noise.
constexpr float kMostNoise = 2.0f;
// Surfaces that are bent by more get other light (cosine).
constexpr float kSameWay = 0.98f;

struct Together {
    glm::vec3 irradiance;
    float error;
};

Together together_at(const GBuffer& g, const DirectLightResult::Apart& apart, std::size_t i)
{
    NoisyWindow window;
    for_each_near(g, i, kReach, [&](std::size_t near) {
        if (g.covered(near) && lies_beside(g, i, near) && glm::dot(g.normal(i), g.normal(near)) > kSameWay)
            window.add(apart.irradiance[near], apart.error[near]);
    });
    if (window.count() < 2.0f) return {apart.irradiance[i], apart.error[i]};
    const float own = window.own_part(kMostNoise);
    return {glm::mix(window.sum() / window.count(), apart.irradiance[i], own),
            apart.error[i] * part_of_error(own, window.count())};
}

}  // namespace

void put_together(const GBuffer& g, const std::vector<std::uint8_t>& keeps, ThreadPool& pool, DirectLightResult& light)
{
    if (light.apart.irradiance.empty()) {
        if (light.irradiance_error.empty()) return;
        light.apart = {light.irradiance, light.irradiance_error};
    }
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!g.covered(i) || (!keeps.empty() && keeps[i] != 0)) continue;
            const Together found = together_at(g, light.apart, i);
            light.irradiance[i] = found.irradiance;
            light.irradiance_error[i] = found.error;
        }
    });
}

}  // namespace rcs
