#pragma once

#include <iterator>
#include <limits>
#include <string_view>

#include "rcs/scene.h"
#include "scene/image_decoder.h"

namespace rcs {

// What a Material holds, a row for each member: from these rows files are read and checked, scenes validated, told
// apart and written. Members that no row can say (emission, alpha mode) are few; whoever uses the rows knows them.

/// A number. glTF's own have no `extension`: their place in the file differs from one to the next.
struct MaterialFactor {
    const char* name;  ///< in messages
    const char* extension;
    const char* key;
    float Material::* value;
    double missing;      ///< where a file has no such key
    double least, most;  ///< most: +inf, it need only be finite
};
inline constexpr double kAnyFactor = std::numeric_limits<double>::infinity();

/// An index of refraction or a tint beyond it reflects all.
inline constexpr double kLargeFactor = 1e4;

inline constexpr MaterialFactor kMaterialFactors[] = {
    {"an alpha", nullptr, "baseColorFactor", &Material::alpha, 1.0, 0.0, 1.0},
    {"a metallic", nullptr, "metallicFactor", &Material::metallic, 1.0, 0.0, 1.0},
    {"a roughness", nullptr, "roughnessFactor", &Material::roughness, 1.0, 0.0, 1.0},
    {"a normal scale", nullptr, "scale", &Material::normal_scale, 1.0, -kAnyFactor, kAnyFactor},
    {"an alpha cutoff", nullptr, "alphaCutoff", &Material::alpha_cutoff, 0.5, 0.0, kAnyFactor},
    {"an index of refraction", "KHR_materials_ior", "ior", &Material::ior, 1.5, 1.0, kLargeFactor},
    {"a specular", "KHR_materials_specular", "specularFactor", &Material::specular, 1.0, 0.0, 1.0},
    {"a transmission", "KHR_materials_transmission", "transmissionFactor", &Material::transmission, 0.0, 0.0, 1.0},
    {"a clearcoat", "KHR_materials_clearcoat", "clearcoatFactor", &Material::clearcoat, 0.0, 0.0, 1.0},
    {"a clearcoat roughness", "KHR_materials_clearcoat", "clearcoatRoughnessFactor", &Material::clearcoat_roughness,
     0.0, 0.0, 1.0},
    {"a sheen roughness", "KHR_materials_sheen", "sheenRoughnessFactor", &Material::sheen_roughness, 0.0, 0.0, 1.0},
    {"an anisotropy", "KHR_materials_anisotropy", "anisotropyStrength", &Material::anisotropy, 0.0, 0.0, 1.0},
    {"an anisotropy rotation", "KHR_materials_anisotropy", "anisotropyRotation", &Material::anisotropy_rotation, 0.0,
     -kAnyFactor, kAnyFactor},
    {"a diffuse transmission", "KHR_materials_diffuse_transmission", "diffuseTransmissionFactor",
     &Material::diffuse_transmission, 0.0, 0.0, 1.0},
};

/// A colour.
struct MaterialColor {
    const char* name;
    const char* extension;
    const char* key;
    glm::vec3 Material::* value;
    double missing;  ///< of each channel
    double most;     ///< of each channel, which is >= 0
};
inline constexpr MaterialColor kMaterialColors[] = {
    {"a base colour", nullptr, "baseColorFactor", &Material::base_color, 1.0, 1.0},
    {"an emission", nullptr, "emissiveFactor", &Material::emission, 0.0, kAnyFactor},
    {"a specular colour", "KHR_materials_specular", "specularColorFactor", &Material::specular_color, 1.0,
     kLargeFactor},
    {"a sheen colour", "KHR_materials_sheen", "sheenColorFactor", &Material::sheen_color, 0.0, 1.0},
    {"a diffuse transmission colour", "KHR_materials_diffuse_transmission", "diffuseTransmissionColorFactor",
     &Material::diffuse_transmission_color, 1.0, 1.0},
};

/// A texture.
struct MaterialTexture {
    const char* place;  ///< the extension or the object of the material that names it; null: the material itself
    const char* key;
    TextureSlot Material::* slot;
    ColorSpace space;
    /// A factor of 0 hides the texture, which is then not worth its memory; null: nothing does.
    float Material::* hidden_by = nullptr;
    bool scatters = true;  ///< changes how the surface reflects and transmits
};
inline constexpr MaterialTexture kMaterialTextures[] = {
    {"pbrMetallicRoughness", "baseColorTexture", &Material::base_color_texture, ColorSpace::srgb},
    {"pbrMetallicRoughness", "metallicRoughnessTexture", &Material::metallic_roughness_texture, ColorSpace::linear},
    {nullptr, "normalTexture", &Material::normal_texture, ColorSpace::linear, nullptr, false},
    {nullptr, "emissiveTexture", &Material::emission_texture, ColorSpace::srgb, nullptr, false},
    {"KHR_materials_specular", "specularTexture", &Material::specular_texture, ColorSpace::linear},
    {"KHR_materials_specular", "specularColorTexture", &Material::specular_color_texture, ColorSpace::srgb},
    {"KHR_materials_transmission", "transmissionTexture", &Material::transmission_texture, ColorSpace::linear,
     &Material::transmission},
    {"KHR_materials_clearcoat", "clearcoatTexture", &Material::clearcoat_texture, ColorSpace::linear,
     &Material::clearcoat},
    {"KHR_materials_clearcoat", "clearcoatRoughnessTexture", &Material::clearcoat_roughness_texture, ColorSpace::linear,
     &Material::clearcoat},
    {"KHR_materials_sheen", "sheenColorTexture", &Material::sheen_color_texture, ColorSpace::srgb},
    {"KHR_materials_sheen", "sheenRoughnessTexture", &Material::sheen_roughness_texture, ColorSpace::linear},
    {"KHR_materials_anisotropy", "anisotropyTexture", &Material::anisotropy_texture, ColorSpace::linear,
     &Material::anisotropy},
    {"KHR_materials_diffuse_transmission", "diffuseTransmissionTexture", &Material::diffuse_transmission_texture,
     ColorSpace::linear, &Material::diffuse_transmission},
    {"KHR_materials_diffuse_transmission", "diffuseTransmissionColorTexture",
     &Material::diffuse_transmission_color_texture, ColorSpace::srgb, &Material::diffuse_transmission},
};

/// What else material extensions may hold that is read or named. A key that is null: the extension has none.
struct MaterialKey {
    const char* extension;
    const char* key;
    enum class Kind { number, color, color_and_alpha, texture, unread_texture } kind;
};
inline constexpr MaterialKey kMaterialKeys[] = {
    {"KHR_materials_emissive_strength", "emissiveStrength", MaterialKey::Kind::number},
    {"KHR_materials_clearcoat", "clearcoatNormalTexture", MaterialKey::Kind::unread_texture},
    {"KHR_materials_unlit", nullptr, MaterialKey::Kind::number},
    {"KHR_materials_pbrSpecularGlossiness", "diffuseFactor", MaterialKey::Kind::color_and_alpha},
    {"KHR_materials_pbrSpecularGlossiness", "diffuseTexture", MaterialKey::Kind::texture},
    {"KHR_materials_pbrSpecularGlossiness", "specularFactor", MaterialKey::Kind::color},
    {"KHR_materials_pbrSpecularGlossiness", "glossinessFactor", MaterialKey::Kind::number},
    {"KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture", MaterialKey::Kind::texture},
};

inline bool is_extension(const char* place) { return place && std::string_view(place).starts_with("KHR_"); }

/// Calls visit(extension, key or null, kind) for all keys of material extensions.
template <typename Visit>
void for_each_material_key(const Visit& visit)
{
    for (const MaterialFactor& f : kMaterialFactors)
        if (f.extension) visit(f.extension, f.key, MaterialKey::Kind::number);
    for (const MaterialColor& c : kMaterialColors)
        if (c.extension) visit(c.extension, c.key, MaterialKey::Kind::color);
    for (const MaterialTexture& t : kMaterialTextures)
        if (is_extension(t.place)) visit(t.place, t.key, MaterialKey::Kind::texture);
    for (const MaterialKey& k : kMaterialKeys) visit(k.extension, k.key, k.kind);
}

// A member without a row would be read from no file and tell no scenes apart.
static_assert(sizeof(Material) ==
                  (sizeof(std::string) + std::size(kMaterialFactors) * sizeof(float) +
                   std::size(kMaterialColors) * sizeof(glm::vec3) + std::size(kMaterialTextures) * sizeof(TextureSlot) +
                   sizeof(AlphaMode) + 2 * sizeof(bool) + alignof(Material) - 1) /
                      alignof(Material) * alignof(Material),
              "give each member of Material a row");

}  // namespace rcs
