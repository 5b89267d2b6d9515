#include "glossy/lobes_together.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "gbuffer/visible_points.h"
#include "glossy/lobe_reach.h"
#include "util/color.h"

namespace rcs {
namespace {

// Pixels to either side that have a part in it, at most: further ones take little noise more, and of a window's
// image in a polished floor the edges.
constexpr int kMostReach = 3;
// ... in widths of the lobe where its rays end.
constexpr float kWidths = 2.0f;
// Normals that are turned by more than this part of the lobe's width see other things.
constexpr float kMostTurned = 0.5f;
// Of the noise's variance: what pixels around make of it by chance may be more.
constexpr float kMostNoise = 1.5f;
// Pixels share rays already, so that so many of them tell no more than one: measured on floors and vats of three
// rooms, their noise from seed to seed is .9 to 1.05 times what is said.
constexpr float kAlike = 6.0f;

/// One kind of light that lobes reflect.
struct Found {
    const std::vector<glm::vec3>& radiance;
    const std::vector<float>& error;
};

glm::vec3 received(glm::vec3 radiance, glm::vec3 reflectance)
{
    glm::vec3 light(0.0f);
    for (int c = 0; c < 3; ++c)
        if (reflectance[c] > 0.0f) light[c] = radiance[c] / reflectance[c];
    return light;
}

struct Together {
    glm::vec3 radiance;
    float error;
};

/// @param near  pixels that lie and look alike, this one among them
Together together_at(const Found& found, const std::vector<glm::vec3>& reflectance, std::span<const std::size_t> near,
                     std::size_t pixel)
{
    glm::vec3 sum(0.0f);
    float light = 0.0f, squares = 0.0f, noise = 0.0f;
    for (const std::size_t i : near) {
        const glm::vec3 one = received(found.radiance[i], reflectance[i]);
        const float l = luminance(one), error = found.error[i] / luminance(reflectance[i]);
        sum += one;
        light += l, squares += l * l, noise += error * error;
    }
    const auto count = static_cast<float>(near.size());
    const float mean = light / count, variance = squares / count - mean * mean;
    const float of_noise = kMostNoise * noise / count;
    const float own = variance > of_noise ? 1.0f - of_noise / variance : 0.0f;
    return {glm::mix(reflectance[pixel] * sum / count, found.radiance[pixel], own),
            found.error[pixel] * std::sqrt(own * own + (1.0f - own * own) / std::max(1.0f, count / kAlike))};
}

/// Pixels whose lobes see about what this one's do, itself among them.
void find_alike(const GBuffer& g, const Shading& shading, const TracedLight& light, std::size_t pixel,
                std::vector<std::size_t>& near)
{
    near.clear();
    const auto reflects = [&](std::size_t i) { return luminance(light.reflectance[i]) > 0.0f; };
    if (!g.covered(pixel) || !shading.is_traced(pixel) || !reflects(pixel)) return;
    const float width = narrowest_traced(shading, pixel);
    const float reach = kWidths * width * light.distance[pixel] / g.footprint[pixel];
    if (!(reach >= 1.0f)) return;
    for_each_near(g, pixel, static_cast<int>(std::min(reach, static_cast<float>(kMostReach))), [&](std::size_t i) {
        if (i == pixel || (may_share(g, shading, pixel, i) && reflects(i) &&
                           glm::distance(g.normal(pixel), g.normal(i)) <= kMostTurned * width))
            near.push_back(i);
    });
}

}  // namespace

void put_together(const GBuffer& g, const Shading& shading, ThreadPool& pool, TracedLight& light)
{
    TracedLight::Apart& apart = light.apart;
    if (apart.radiance.empty()) apart = {light.radiance, light.error, light.of_lamps, light.of_lamps_error};
    pool.parallel_for(g.size(), 256, [&](std::size_t begin, std::size_t end, int) {
        std::vector<std::size_t> near;
        const auto put = [&](std::size_t i, const Found& found, std::vector<glm::vec3>& radiance,
                             std::vector<float>& error) {
            const Together here = near.size() > 1 ? together_at(found, light.reflectance, near, i)
                                                  : Together{found.radiance[i], found.error[i]};
            radiance[i] = here.radiance, error[i] = here.error;
        };
        for (std::size_t i = begin; i < end; ++i) {
            find_alike(g, shading, light, i, near);
            put(i, {apart.radiance, apart.error}, light.radiance, light.error);
            if (!apart.of_lamps.empty())
                put(i, {apart.of_lamps, apart.of_lamps_error}, light.of_lamps, light.of_lamps_error);
        }
    });
}

}  // namespace rcs
