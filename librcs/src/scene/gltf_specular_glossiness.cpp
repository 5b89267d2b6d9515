#include "scene/gltf_specular_glossiness.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scene/material_fields.h"
#include "scene/texture.h"
#include "util/color.h"

namespace rcs {
namespace {

/// Square root of the reflectance that an index of refraction as large as can be stands for.
constexpr float kRoot = (static_cast<float>(kLargeFactor) - 1.0f) / (static_cast<float>(kLargeFactor) + 1.0f);

const Texture& texture_of(const TextureReader& textures, const TextureSlot& slot)
{
    return textures.scene().textures[static_cast<std::size_t>(slot.texture)];
}

/// A texture of that size whose texels are value(uv of their centres).
template <typename Value>
Texture make_texels(std::string name, int width, int height, const Value& value)
{
    Texture::Level level{width, height, {}};
    level.texels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::vec4 v = value(glm::vec2((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                                                (static_cast<float>(y) + 0.5f) / static_cast<float>(height)));
            auto& texel = level.texels.emplace_back();
            for (int c = 0; c < 4; ++c)
                texel[static_cast<std::size_t>(c)] =
                    static_cast<std::uint16_t>(std::lround(65535.0f * std::clamp(v[c], 0.0f, 1.0f)));
        }
    }
    return make_texture(std::move(name), std::move(level));
}

/// Roughness in G, where metallic-roughness textures have it.
Texture roughness_texture(const Texture& gloss, float factor)
{
    const Texture::Level& size = gloss.levels[0];
    return make_texels(gloss.name, size.width, size.height, [&](glm::vec2 uv) {
        return glm::vec4(1.0f, 1.0f - factor * sample_nearest(gloss, uv, 0).a, 1.0f, 1.0f);
    });
}

/// What the specular reflection leaves, times the diffuse texture if there is one.
/// @param slot  of both
Texture base_texture(const Texture* diffuse, const Texture& specular, glm::vec3 factor, const TextureSlot& slot)
{
    const Texture::Level &a = specular.levels[0], &b = diffuse ? diffuse->levels[0] : a;
    return make_texels(specular.name, std::max(a.width, b.width), std::max(a.height, b.height), [&](glm::vec2 uv) {
        const float left = 1.0f - largest(factor * glm::vec3(sample_bilinear(specular, uv, slot.wrap_u, slot.wrap_v)));
        const glm::vec4 color = diffuse ? sample_bilinear(*diffuse, uv, slot.wrap_u, slot.wrap_v) : glm::vec4(1.0f);
        return glm::vec4(left * glm::vec3(color), color.a);
    });
}

bool are_mapped_alike(const TextureSlot& a, const TextureSlot& b)
{
    return a.uv_set == b.uv_set && a.texture_from_uv == b.texture_from_uv && a.wrap_u == b.wrap_u &&
           a.wrap_v == b.wrap_v;
}

}  // namespace

bool set_specular_glossiness(const SpecularGlossiness& from, TextureReader& textures, const std::string& user,
                             Material& m)
{
    m.metallic = 0.0f;
    m.specular = 1.0f;
    m.specular_texture = {};
    m.ior = static_cast<float>(kLargeFactor);
    m.specular_color = from.specular / (kRoot * kRoot);
    m.specular_color_texture = from.specular_texture;
    m.base_color = from.diffuse;
    m.base_color_texture = from.diffuse_texture;
    m.roughness = 1.0f - from.glossiness;
    m.metallic_roughness_texture = {};
    if (!from.specular_texture.used()) {
        m.base_color *= 1.0f - largest(from.specular);
        return true;
    }
    m.roughness = 1.0f;
    m.metallic_roughness_texture = from.specular_texture;
    m.metallic_roughness_texture.texture =
        textures.keep(roughness_texture(texture_of(textures, from.specular_texture), from.glossiness), user);

    const Texture& specular = texture_of(textures, from.specular_texture);
    const bool has_diffuse = from.diffuse_texture.used();
    if (has_diffuse && !are_mapped_alike(from.diffuse_texture, from.specular_texture)) {
        m.base_color *= 1.0f - largest(from.specular * glm::vec3(texel_value(specular.levels.back(), 0, 0)));
        return false;
    }
    m.base_color_texture = has_diffuse ? from.diffuse_texture : from.specular_texture;
    const Texture* diffuse = has_diffuse ? &texture_of(textures, from.diffuse_texture) : nullptr;
    m.base_color_texture.texture =
        textures.keep(base_texture(diffuse, specular, from.specular, from.specular_texture), user);
    return true;
}

}  // namespace rcs
