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

/// A coordinate that is not repeated, brought into [0, 1].
inline float wrapped_fraction(float x, Wrap wrap)
{
    if (wrap == Wrap::repeat) return repeat_fraction(x);
    if (wrap == Wrap::clamp_to_edge) return x > 0.0f ? std::min(x, 1.0f) : 0.0f;
    const float fraction = 2.0f * repeat_fraction(0.5f * x);
    return fraction > 1.0f ? 2.0f - fraction : fraction;
}

inline glm::vec4 texel_value(const Texture::Level& level, int x, int y)
{
    const auto& texel =
        level.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) + static_cast<std::size_t>(x)];
    return glm::vec4(texel[0], texel[1], texel[2], texel[3]) * (1.0f / 65535.0f);
}

/// Nearest texel of mip level `level` (clamped to those there are). @param uv  any finite value
inline glm::vec4 sample_nearest(const Texture& texture, glm::vec2 uv, int level, Wrap wrap_u = Wrap::repeat,
                                Wrap wrap_v = Wrap::repeat)
{
    const int last = static_cast<int>(texture.levels.size()) - 1;
    const Texture::Level& texels = texture.levels[static_cast<std::size_t>(std::clamp(level, 0, last))];
    const int x = static_cast<int>(wrapped_fraction(uv.x, wrap_u) * static_cast<float>(texels.width));
    const int y = static_cast<int>(wrapped_fraction(uv.y, wrap_v) * static_cast<float>(texels.height));
    return texel_value(texels, std::min(x, texels.width - 1), std::min(y, texels.height - 1));
}

/// Bilinear sample of the full-size level.
glm::vec4 sample_bilinear(const Texture& texture, glm::vec2 uv, Wrap wrap_u = Wrap::repeat, Wrap wrap_v = Wrap::repeat);

/// Filtered over the parallelogram that duv_dx and duv_dy span: trilinear probes along its long axis.
/// @param slot  how the texture is wrapped and magnified; its transform is not applied
glm::vec4 sample_filtered(const Texture& texture, glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy,
                          const TextureSlot& slot = {});

/// What a material's texture slot says of a point. @param uv, duv_dx, duv_dy  of the slot's set: its transform is
/// applied here
glm::vec4 sample_slot(const Scene& scene, const TextureSlot& slot, glm::vec2 uv, glm::vec2 duv_dx, glm::vec2 duv_dy);

/// The same, one texel of a mip level: for rays that see a cone wider than texels. An unused slot gives 1.
inline glm::vec4 sample_slot_nearest(const Scene& scene, const TextureSlot& slot, glm::vec2 uv, int level)
{
    if (!slot.used()) return glm::vec4(1.0f);
    return sample_nearest(scene.textures[static_cast<std::size_t>(slot.texture)],
                          slot.texture_from_uv * glm::vec3(uv, 1.0f), level, slot.wrap_u, slot.wrap_v);
}

/// Builds the mip chain of linear RGB texels (box filter). Values outside [0, 1] are clamped.
Texture make_texture(std::string name, int width, int height, const std::vector<glm::vec3>& linear_rgb);

/// The same from texels as they are stored.
Texture make_texture(std::string name, Texture::Level full_size);

}  // namespace rcs
