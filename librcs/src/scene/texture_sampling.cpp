#include "scene/texture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace rcs {
namespace {

/// The texels before and after a coordinate, which lies between their centres at (i + 1/2) / n.
struct Neighbors {
    int before, after;
    float blend;  // 0: all of `before`
};
Neighbors neighbors(float coordinate, int size, Wrap wrap)
{
    const float x = wrapped_fraction(coordinate, wrap) * static_cast<float>(size) - 0.5f;
    const int below = static_cast<int>(x + 1.0f) - 1;  // floor, as x >= -1/2
    // Beyond the edge lies the other edge, or (mirrored, clamped) the same texel again.
    const bool repeats = wrap == Wrap::repeat;
    const int before = below < 0 ? (repeats ? size - 1 : 0) : std::min(below, size - 1);
    const int after = below + 1 >= size ? (repeats ? 0 : size - 1) : below + 1;
    return {before, after, x - static_cast<float>(below)};
}

/// Four channels side by side, in one register.
using Lanes = float __attribute__((vector_size(16)));

glm::vec4 as_vector(Lanes v) { return {v[0], v[1], v[2], v[3]}; }

/// As texel_value().
Lanes texel_lanes(const std::array<std::uint16_t, 4>& texel)
{
    using Codes = std::uint16_t __attribute__((vector_size(8)));
    using Wide = std::int32_t __attribute__((vector_size(16)));
    const auto codes = std::bit_cast<Codes>(texel);
    return __builtin_convertvector(__builtin_convertvector(codes, Wide), Lanes) * (1.0f / 65535.0f);
}

/// As glm::mix().
Lanes mix(Lanes a, Lanes b, float t) { return a * (1.0f - t) + b * t; }

Lanes bilinear_lanes(const Texture::Level& level, glm::vec2 uv, Wrap wrap_u, Wrap wrap_v)
{
    const Neighbors x = neighbors(uv.x, level.width, wrap_u), y = neighbors(uv.y, level.height, wrap_v);
    const auto* const texels = level.texels.data();
    const auto row = [&](int j) {
        return texels + static_cast<std::size_t>(j) * static_cast<std::size_t>(level.width);
    };
    const auto* const before = row(y.before);
    const auto* const after = row(y.after);
    const Lanes upper = mix(texel_lanes(before[x.before]), texel_lanes(before[x.after]), x.blend);
    const Lanes lower = mix(texel_lanes(after[x.before]), texel_lanes(after[x.after]), x.blend);
    return mix(upper, lower, y.blend);
}

glm::vec4 bilinear(const Texture::Level& level, glm::vec2 uv, Wrap wrap_u, Wrap wrap_v)
{
    return as_vector(bilinear_lanes(level, uv, wrap_u, wrap_v));
}

/// The two levels between which a filter's width lies.
struct LevelPair {
    const Texture::Level* fine;
    const Texture::Level* coarse;  ///< null: the finer one alone
    float blend;                   ///< 0: all of `fine`

    /// @param width  of the filter, in texels of the full size
    LevelPair(const Texture& texture, float width)
    {
        const float depth = std::log2(std::max(width, 1.0f));
        const auto last = texture.levels.size() - 1;
        const auto finer = std::min(static_cast<std::size_t>(depth), last);
        fine = &texture.levels[finer];
        blend = depth - static_cast<float>(finer);
        coarse = finer == last || blend <= 0.0f ? nullptr : &texture.levels[finer + 1];
    }
};

Lanes trilinear(const LevelPair& levels, const TextureSlot& slot, glm::vec2 uv)
{
    const Lanes fine = bilinear_lanes(*levels.fine, uv, slot.wrap_u, slot.wrap_v);
    if (!levels.coarse) return fine;
    return mix(fine, bilinear_lanes(*levels.coarse, uv, slot.wrap_u, slot.wrap_v), levels.blend);
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

glm::vec4 sample_bilinear(const Texture& texture, glm::vec2 uv, Wrap wrap_u, Wrap wrap_v)
{
    return bilinear(texture.levels.front(), uv, wrap_u, wrap_v);
}

glm::vec4 sample_filtered(const Texture& texture, glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy,
                          const TextureSlot& slot)
{
    const auto magnified = [&] {
        return slot.nearest ? sample_nearest(texture, uv, 0, slot.wrap_u, slot.wrap_v)
                            : bilinear(texture.levels.front(), uv, slot.wrap_u, slot.wrap_v);
    };
    if (duv_dx == glm::vec2(0.0f) && duv_dy == glm::vec2(0.0f)) return magnified();
    constexpr int kMaxProbes = 16;  // as many as GPUs offer for anisotropic filtering
    const Texture::Level& full = texture.levels.front();
    const glm::vec2 size(full.width, full.height);
    const Footprint footprint = footprint_of(size, duv_dx, duv_dy);
    // A footprint beyond every number (a horizon) sees the mean of the texture.
    if (!std::isfinite(footprint.long_width) || !std::isfinite(footprint.short_width)) {
        return texel_value(texture.levels.back(), 0, 0);
    }
    if (footprint.long_width <= 1.0f) return magnified();

    const float probe_width = std::max({1.0f, footprint.short_width, footprint.long_width / kMaxProbes});
    const int probes = std::clamp(static_cast<int>(std::ceil(footprint.long_width / probe_width)), 1, kMaxProbes);
    const LevelPair levels(texture, probe_width);
    Lanes sum = {};
    for (int i = 0; i < probes; ++i) {
        const float along = (static_cast<float>(i) + 0.5f) / static_cast<float>(probes) - 0.5f;
        sum += trilinear(levels, slot, uv + along * footprint.long_axis);
    }
    return as_vector(sum / static_cast<float>(probes));
}

glm::vec4 sample_slot(const Scene& scene, const TextureSlot& slot, glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy)
{
    const Texture& texture = scene.textures[static_cast<std::size_t>(slot.texture)];
    const auto turned = [&](glm::vec2 d) { return slot.texture_from_uv * glm::vec3(d, 0.0f); };
    return sample_filtered(texture, slot.texture_from_uv * glm::vec3(uv, 1.0f), turned(duv_dx), turned(duv_dy), slot);
}

}  // namespace rcs
