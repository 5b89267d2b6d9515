#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/scene.h"

namespace rcs {

/// Fraction of a repeated texture coordinate, in [0, 1]; 1 only by rounding, from just below 0.
inline float repeat_fraction(float x)
{
    // From 2^23 on a float has no fraction bits; from 2^31 on it does not fit an int.
    if (!(std::fabs(x) < 0x1p30f)) return 0.0f;
    const float fraction = x - static_cast<float>(static_cast<int>(x));
    return fraction < 0.0f ? fraction + 1.0f : fraction;
}

inline glm::vec3 texel_value(const Texture::Level& level, int x, int y)
{
    const auto& texel = level.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) +
                                     static_cast<std::size_t>(x)];
    return glm::vec3(texel[0], texel[1], texel[2]) * (1.0f / 65535.0f);
}

/// Nearest texel of mip level `level` (clamped to those there are). @param uv  any finite value, repeated
inline glm::vec3 sample_nearest(const Texture& texture, glm::vec2 uv, int level)
{
    const int last = static_cast<int>(texture.levels.size()) - 1;
    const Texture::Level& texels = texture.levels[static_cast<std::size_t>(std::clamp(level, 0, last))];
    const int x = static_cast<int>(repeat_fraction(uv.x) * static_cast<float>(texels.width));
    const int y = static_cast<int>(repeat_fraction(uv.y) * static_cast<float>(texels.height));
    return texel_value(texels, std::min(x, texels.width - 1), std::min(y, texels.height - 1));
}

/// Bilinear sample of the full-size level.
glm::vec3 sample_bilinear(const Texture& texture, glm::vec2 uv);

/// Filtered over the parallelogram that duv_dx and duv_dy span: trilinear probes along its long axis.
glm::vec3 sample_filtered(const Texture& texture, glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy);

/// Builds the mip chain of linear RGB texels (box filter). Values outside [0, 1] are clamped.
Texture make_texture(std::string name, int width, int height, const std::vector<glm::vec3>& linear_rgb);

/// The same from texels as they are stored.
Texture make_texture(std::string name, Texture::Level full_size);

/// Albedo at a ray hit, unfiltered: base colour x bilinear texture.
glm::vec3 albedo_at(const Scene& scene, const Material& material, glm::vec2 uv);

}  // namespace rcs
