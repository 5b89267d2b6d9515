#include "scene/texture.h"

#include <cstdint>
#include <string>
#include <utility>

#include "rcs/error.h"

namespace rcs {
namespace {

using Texel = std::array<std::uint16_t, 4>;

/// The source texels that one texel of the next level covers along one axis, and by how much.
/// Weights are whole numbers, so that no rounding moves the mean.
struct Taps {
    int first = 0;
    int count = 1;
    std::uint64_t weight[3] = {1, 0, 0};
};

/// Texel i of `half` covers source texels [i s/n, (i+1) s/n), s = `full`, n = `half` = max(1, floor(s/2)).
Taps taps_of(int i, int full, int half)
{
    if (full == 1) return {};
    if (full == 2 * half) return {2 * i, 2, {1, 1, 0}};
    // s = 2n + 1: in units of 1/n texel the interval is [i s, (i+1) s) = [2i n + i, 2i n + 2n + i + 1).
    const auto n = static_cast<std::uint64_t>(half);
    const auto at = static_cast<std::uint64_t>(i);
    return {2 * i, 3, {n - at, n, at + 1}};
}

std::vector<Taps> all_taps(int full, int half)
{
    std::vector<Taps> taps(static_cast<std::size_t>(half));
    for (int i = 0; i < half; ++i) taps[static_cast<std::size_t>(i)] = taps_of(i, full, half);
    return taps;
}

Texel weighted_mean(const Texture::Level& source, const Taps& across, const Taps& down)
{
    std::uint64_t sum[3] = {0, 0, 0};
    std::uint64_t total = 0;
    for (int j = 0; j < down.count; ++j) {
        const Texel* row = source.texels.data() + static_cast<std::size_t>(down.first + j) *
                                                      static_cast<std::size_t>(source.width) + across.first;
        for (int i = 0; i < across.count; ++i) {
            const std::uint64_t weight = across.weight[i] * down.weight[j];
            for (int channel = 0; channel < 3; ++channel) {
                sum[channel] += weight * row[i][static_cast<std::size_t>(channel)];
            }
            total += weight;
        }
    }
    const auto rounded = [&](std::uint64_t value) { return static_cast<std::uint16_t>((value + total / 2) / total); };
    return {rounded(sum[0]), rounded(sum[1]), rounded(sum[2]), 0};
}

/// The common case of two even sides, in 32-bit arithmetic.
Texel mean_of_four(const Texel* upper, const Texel* lower)
{
    Texel mean{};
    for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint32_t sum = std::uint32_t{upper[0][channel]} + upper[1][channel] + lower[0][channel] +
                                  lower[1][channel];
        mean[channel] = static_cast<std::uint16_t>((sum + 2) / 4);
    }
    return mean;
}

Texture::Level halve(const Texture::Level& source)
{
    Texture::Level level;
    level.width = std::max(1, source.width / 2);
    level.height = std::max(1, source.height / 2);
    level.texels.reserve(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height));
    const bool even = source.width % 2 == 0 && source.height % 2 == 0;
    const std::vector<Taps> columns = all_taps(source.width, level.width);
    for (int y = 0; y < level.height; ++y) {
        const Taps down = taps_of(y, source.height, level.height);
        const Texel* upper = source.texels.data() +
                             static_cast<std::size_t>(down.first) * static_cast<std::size_t>(source.width);
        for (const Taps& across : columns) {
            level.texels.push_back(even ? mean_of_four(upper + across.first, upper + source.width + across.first)
                                        : weighted_mean(source, across, down));
        }
    }
    return level;
}

glm::vec3 bilinear(const Texture::Level& level, glm::vec2 uv)
{
    // Texel centres lie at (i + 1/2) / n.
    const float x = repeat_fraction(uv.x) * static_cast<float>(level.width) - 0.5f;
    const float y = repeat_fraction(uv.y) * static_cast<float>(level.height) - 0.5f;
    const int column = static_cast<int>(x + 1.0f) - 1;  // floor, as x >= -1/2
    const int row = static_cast<int>(y + 1.0f) - 1;
    const float fx = x - static_cast<float>(column);
    const float fy = y - static_cast<float>(row);
    const int x0 = column < 0 ? level.width - 1 : std::min(column, level.width - 1);
    const int y0 = row < 0 ? level.height - 1 : std::min(row, level.height - 1);
    const int x1 = x0 + 1 == level.width ? 0 : x0 + 1;
    const int y1 = y0 + 1 == level.height ? 0 : y0 + 1;
    const glm::vec3 upper = glm::mix(texel_value(level, x0, y0), texel_value(level, x1, y0), fx);
    const glm::vec3 lower = glm::mix(texel_value(level, x0, y1), texel_value(level, x1, y1), fx);
    return glm::mix(upper, lower, fy);
}

/// @param width  of the filter, in texels of the full size
glm::vec3 trilinear(const Texture& texture, glm::vec2 uv, float width)
{
    const float depth = std::log2(std::max(width, 1.0f));
    const auto last = texture.levels.size() - 1;
    const auto finer = std::min(static_cast<std::size_t>(depth), last);
    const glm::vec3 fine = bilinear(texture.levels[finer], uv);
    const float blend = depth - static_cast<float>(finer);
    if (finer == last || blend <= 0.0f) return fine;
    return glm::mix(fine, bilinear(texture.levels[finer + 1], uv), blend);
}

/// Axes of the ellipse that a pixel's disc becomes on the texture.
struct Footprint {
    glm::vec2 long_axis;  ///< in uv, as long as the footprint
    float long_width;     ///< [texels]
    float short_width;    ///< [texels]
};

/// The singular values of (dx dy), and the direction that belongs to the larger: unlike the two
/// edges they do not depend on how the pixel grid is turned.
Footprint footprint_of(glm::vec2 size, glm::vec2 duv_dx, glm::vec2 duv_dy)
{
    const glm::dvec2 dx = glm::dvec2(duv_dx * size);
    const glm::dvec2 dy = glm::dvec2(duv_dy * size);
    const double xx = dx.x * dx.x + dy.x * dy.x;
    const double xy = dx.x * dx.y + dy.x * dy.y;
    const double yy = dx.y * dx.y + dy.y * dy.y;
    const double root = std::hypot(xx - yy, 2.0 * xy);
    const double large = std::sqrt(0.5 * (xx + yy + root));
    const double area = std::fabs(dx.x * dy.y - dx.y * dy.x);
    const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
    const glm::dvec2 direction(std::cos(angle), std::sin(angle));
    return {glm::vec2(direction * large) / size, static_cast<float>(large),
            large > 0.0 ? static_cast<float>(area / large) : 0.0f};
}

}  // namespace

glm::vec3 sample_bilinear(const Texture& texture, glm::vec2 uv) { return bilinear(texture.levels.front(), uv); }

glm::vec3 sample_filtered(const Texture& texture, glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy)
{
    constexpr int kMaxProbes = 16;  // as many as GPUs offer for anisotropic filtering
    const Texture::Level& full = texture.levels.front();
    const glm::vec2 size(full.width, full.height);
    const Footprint footprint = footprint_of(size, duv_dx, duv_dy);
    // A footprint beyond every number (a horizon) sees the mean of the texture.
    if (!std::isfinite(footprint.long_width) || !std::isfinite(footprint.short_width)) {
        return texel_value(texture.levels.back(), 0, 0);
    }
    if (footprint.long_width <= 1.0f) return bilinear(full, uv);

    const float probe_width = std::max({1.0f, footprint.short_width, footprint.long_width / kMaxProbes});
    const int probes = std::clamp(static_cast<int>(std::ceil(footprint.long_width / probe_width)), 1, kMaxProbes);
    glm::vec3 sum(0.0f);
    for (int i = 0; i < probes; ++i) {
        const float along = (static_cast<float>(i) + 0.5f) / static_cast<float>(probes) - 0.5f;
        sum += trilinear(texture, uv + along * footprint.long_axis, probe_width);
    }
    return sum / static_cast<float>(probes);
}

Texture make_texture(std::string name, Texture::Level full_size)
{
    Texture texture;
    texture.name = std::move(name);
    texture.levels.push_back(std::move(full_size));
    while (texture.levels.back().width > 1 || texture.levels.back().height > 1) {
        texture.levels.push_back(halve(texture.levels.back()));
    }
    return texture;
}

Texture make_texture(std::string name, int width, int height, const std::vector<glm::vec3>& linear_rgb)
{
    if (width < 1 || height < 1 ||
        linear_rgb.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
        throw Error(ErrorCode::bad_argument, "texture '" + name + "' has " + std::to_string(linear_rgb.size()) +
                                                 " texels, expected " + std::to_string(width) + " x " +
                                                 std::to_string(height) + ", each side at least 1");
    }
    // A comparison with NaN is false: it becomes 0.
    const auto code = [](float value) {
        return static_cast<std::uint16_t>(value > 0.0f ? std::min(value, 1.0f) * 65535.0f + 0.5f : 0.0f);
    };
    Texture::Level level{width, height, {}};
    level.texels.reserve(linear_rgb.size());
    for (const glm::vec3& rgb : linear_rgb) level.texels.push_back({code(rgb.r), code(rgb.g), code(rgb.b), 0});
    return make_texture(std::move(name), std::move(level));
}

glm::vec3 albedo_at(const Scene& scene, const Material& material, glm::vec2 uv)
{
    if (!material.base_color_texture.used()) return material.base_color;
    return material.base_color *
           sample_bilinear(scene.textures[static_cast<std::size_t>(material.base_color_texture.texture)], uv);
}

}  // namespace rcs
