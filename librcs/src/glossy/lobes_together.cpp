#include "glossy/lobes_together.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "gbuffer/visible_points.h"
#include "glossy/lobe_reach.h"
#include "util/color.h"
#include "util/noisy_window.h"

namespace rcs {
namespace {

// Pixels to either side that have a part in it, at most: further ones take little noise more, and of a window's
// image in a polished floor the edges. A loft at 3, 4, 6: indirect light off by 8.8, 8.8, 8.8 %, highlights of lamps by
// 10.5, 10.9, 11.9 %.
constexpr int kMostReach = 3;
// ... in widths of the lobe where its rays end: at 1, 2, 4 a bathroom's indirect light is off by 6.1, 5.9, 5.3 %, and
// veach-ajar's by 9.5, 9.6, 9.6.
constexpr float kWidths = 2.0f;
// Normals that are turned by more than this part of the lobe's width see other things.
constexpr float kMostTurned = 0.5f;
// Of the noise's variance; with 1 living-room is off as much, to .02 %.
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
    NoisyWindow window;
    for (const std::size_t i : near)
        window.add(received(found.radiance[i], reflectance[i]), found.error[i] / luminance(reflectance[i]));
    const float own = window.own_part(kMostNoise);
    return {glm::mix(reflectance[pixel] * window.sum() / window.count(), found.radiance[pixel], own),
            found.error[pixel] * part_of_error(own, window.count() / kAlike)};
}

/// Pixels whose lobes see about what this one's do, itself among them.
void find_alike(const GBuffer& g, const Shading& shading, const TracedLight& light, std::size_t pixel,
                std::vector<std::size_t>& near)
{
    near.clear();
    const auto reflects = [&](std::size_t i) { return luminance(light.reflectance[i]) > 0.0f; };
    if (!g.covered(pixel) || !shading.is_traced(pixel) || !reflects(pixel)) return;
    const float width = shading.traced[pixel];
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
