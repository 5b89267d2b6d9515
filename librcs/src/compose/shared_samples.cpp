#include "compose/shared_samples.h"

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>

#include "compose/layer_sums.h"

namespace rcs {
namespace {

/// All light of the pass, pixel by pixel.
std::vector<glm::vec3> light_of(const LayeredImage& sums, std::size_t pixels)
{
    std::vector<glm::vec3> light(pixels, glm::vec3(0.0f));
    for (const char* part : kBeautyParts) {
        const auto found = sums.layers.find(part);
        if (found == sums.layers.end()) continue;
        const std::vector<float>& values = found->second.pixels;
        for (std::size_t i = 0; i < pixels; ++i)
            light[i] += glm::vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    }
    return light;
}

// Light may grow by so much more than kSmooth from a pixel to the next if it does so evenly: the first sample is the
// pixel's centre, and its mean.
constexpr float kEven = 2.5f;

bool within(glm::vec3 difference, float part, glm::vec3 of)
{
    return glm::all(glm::lessThanEqual(glm::abs(difference), part * static_cast<float>(kSmooth) * of));
}

/// Whether light changes evenly, and little, from `a` to `c` to `b`.
bool is_even(glm::vec3 a, glm::vec3 c, glm::vec3 b)
{
    return within(a - c, kEven, c) && within(b - c, kEven, c) && within(0.5f * (a + b) - c, 1.0f, c);
}

}  // namespace

SharedSamples find_smooth(const GBuffer& g, const DirectLightResult& direct, std::span<const PixelAtContact> contacts,
                          const LayeredImage& sums, ThreadPool& pool)
{
    SharedSamples shared{{std::vector<std::uint32_t>(g.size(), GBuffer::kNone), g.primitive, {}},
                         sums,
                         {contacts.begin(), contacts.end()}};
    const std::vector<glm::vec3> light = light_of(sums, g.size());
    const auto index = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(x);
    };
    const auto is_smooth = [&](int x, int y) {
        if (x == 0 || y == 0 || x + 1 == g.width || y + 1 == g.height) return false;
        const auto is_even_along = [&](int dx, int dy) {
            return is_even(light[index(x - dx, y - dy)], light[index(x, y)], light[index(x + dx, y + dy)]);
        };
        return is_even_along(1, 0) && is_even_along(0, 1) && is_even_along(1, 1) && is_even_along(1, -1);
    };
    pool.parallel_for(g.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t width = static_cast<std::size_t>(g.width);
            const bool is_exact = direct.in_part.empty() || direct.in_part[i] == 0;
            if (g.covered(i) && is_exact && is_smooth(static_cast<int>(i % width), static_cast<int>(i / width)))
                shared.known.instance[i] = g.instance[i];
        }
    });
    for (const PixelAtContact& c : contacts) shared.known.instance[c.pixel] = GBuffer::kNone;
    return shared;
}

std::size_t add_shared(const SharedSamples& shared, LayeredImage& sums)
{
    const std::vector<std::uint8_t>& met = shared.known.met;
    for (auto& [name, image] : sums.layers) layer_sum(name).repeat(shared.first.layers.at(name), met, image);
    return static_cast<std::size_t>(std::count(met.begin(), met.end(), std::uint8_t{1}));
}

}  // namespace rcs
