#include "scene/gltf_material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "scene/gltf_specular_glossiness.h"
#include "scene/material_fields.h"
#include "util/text.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kClampedColor{"base colour outside [0, 1]", "material", "clamped"};
constexpr GltfNoteKind kClamped{"values outside their range", "field", "clamped"};
constexpr GltfNoteKind kClearcoatNormal{"clearcoat normal textures", "material", "ignored"};
constexpr GltfNoteKind kMappedUnlike{"specular-glossiness textures that are mapped unlike the diffuse one", "material",
                                     "their mean darkens the diffuse colour"};
constexpr GltfNoteKind kAlphaMode{"an alpha mode that glTF does not have", "material", "rendered opaque"};

// Numbers beyond it are as good as this one.
constexpr double kLargestFactor = 1e6;

constexpr std::size_t kTextures = std::size(kMaterialTextures);

/// How a file's material uses the textures of kMaterialTextures, then others that are read. `occlusionTexture` is not
/// among them: the renderer computes occlusion.
using TextureUses = std::vector<TextureUse>;

const tinygltf::Value& extension_of(const tinygltf::Material& material, const char* name)
{
    static const tinygltf::Value none;
    const auto found = material.extensions.find(name);
    return found == material.extensions.end() ? none : found->second;
}

/// @return a texture that glTF's core names
TextureUse core_texture_use(const tinygltf::Material& material, std::string_view key)
{
    const auto use = [](const auto& info) { return texture_use(info.index, info.texCoord, info.extensions); };
    if (key == "baseColorTexture") return use(material.pbrMetallicRoughness.baseColorTexture);
    if (key == "metallicRoughnessTexture") return use(material.pbrMetallicRoughness.metallicRoughnessTexture);
    return key == "normalTexture" ? use(material.normalTexture) : use(material.emissiveTexture);
}

TextureUses texture_uses(const tinygltf::Material& material)
{
    TextureUses uses;
    for (const MaterialTexture& t : kMaterialTextures)
        uses.push_back(is_extension(t.place) ? texture_use(extension_of(material, t.place), t.key)
                                             : core_texture_use(material, t.key));
    for (const MaterialKey& k : kMaterialKeys)
        if (k.kind == MaterialKey::Kind::texture)
            uses.push_back(texture_use(extension_of(material, k.extension), k.key));
    return uses;
}

/// Reads the numbers of one material.
struct Factors {
    const GltfFile& file;
    const tinygltf::Material& source;
    std::string name;  ///< for notes
    std::string what;  ///< for messages

    float clamped(const MaterialFactor& field, double value) const
    {
        return clamped(field.key, value, field.least, field.most);
    }
    float clamped(const char* key, double value, double least, double most) const
    {
        most = std::min(most, kLargestFactor);
        least = std::max(least, -kLargestFactor);
        const double result = std::clamp(value, least, most);
        if (result != value)
            file.notes->add(kClamped,
                            name + ": " + text("%s is %g, expected a value in [%g, %g]", key, value, least, most));
        return static_cast<float>(result);
    }

    double of(const char* extension, const char* key, double missing) const
    {
        const tinygltf::Value& values = extension_of(source, extension);
        return values.Has(key) ? values.Get(key).GetNumberAsDouble() : missing;
    }

    glm::dvec3 color_of(const MaterialColor& field) const
    {
        const tinygltf::Value& values = extension_of(source, field.extension);
        if (!values.Has(field.key)) return glm::dvec3(field.missing);
        const tinygltf::Value& color = values.Get(field.key);
        return {color.Get(0).GetNumberAsDouble(), color.Get(1).GetNumberAsDouble(), color.Get(2).GetNumberAsDouble()};
    }
};

void read_base_color(const Factors& factors, Material& material)
{
    const std::vector<double>& factor = factors.source.pbrMetallicRoughness.baseColorFactor;
    const glm::dvec3 asked(factor.at(0), factor.at(1), factor.at(2));
    material.base_color = glm::vec3(glm::clamp(asked, 0.0, 1.0));
    if (glm::clamp(asked, 0.0, 1.0) != asked) factors.file.notes->add(kClampedColor, factors.name);
    material.alpha = factors.clamped("baseColorFactor", factor.at(3), 0.0, 1.0);
}

/// @throws Error bad_file
glm::vec3 read_emission(const Factors& factors)
{
    const std::vector<double>& factor = factors.source.emissiveFactor;
    if (factor.size() < 3) return glm::vec3(0.0f);
    const glm::vec3 radiance = glm::dvec3(factor[0], factor[1], factor[2]) *
                               factors.of("KHR_materials_emissive_strength", "emissiveStrength", 1.0);
    for (int channel = 0; channel < 3; ++channel) {
        if (!(radiance[channel] >= 0.0f) || !std::isfinite(radiance[channel])) {
            bad_file(factors.file, factors.what + " emits " + std::to_string(radiance[channel]) +
                                       ", expected a finite radiance >= 0");
        }
    }
    return radiance;
}

void read_alpha_mode(const Factors& factors, Material& material)
{
    const std::string& mode = factors.source.alphaMode;
    if (mode == "MASK")
        material.alpha_mode = AlphaMode::mask;
    else if (mode == "BLEND")
        material.alpha_mode = AlphaMode::blend;
    else if (mode != "OPAQUE" && !mode.empty())
        factors.file.notes->add(kAlphaMode, factors.name);
    // A cutoff above 1 is allowed and hides everything.
    material.alpha_cutoff = factors.clamped("alphaCutoff", factors.source.alphaCutoff, 0.0, 2.0);
}

void read_extensions(const Factors& factors, Material& material)
{
    for (const MaterialFactor& f : kMaterialFactors) {
        if (!f.extension) continue;
        double value = factors.of(f.extension, f.key, f.missing);
        // 0 stands for a mirror that no index of refraction gives (KHR_materials_ior).
        if (f.value == &Material::ior && value == 0.0) value = kLargeFactor;
        material.*f.value = factors.clamped(f, value);
    }
    for (const MaterialColor& c : kMaterialColors) {
        if (!c.extension) continue;
        const glm::dvec3 color = factors.color_of(c);
        for (int i = 0; i < 3; ++i) (material.*c.value)[i] = factors.clamped(c.key, color[i], 0.0, c.most);
    }
    if (extension_of(factors.source, "KHR_materials_clearcoat").Has("clearcoatNormalTexture")) {
        factors.file.notes->add(kClearcoatNormal, factors.name);
    }
    material.unlit = factors.source.extensions.count("KHR_materials_unlit") > 0;
}

/// What a factor of 0 hides is not worth its memory.
bool is_seen(const MaterialTexture& texture, const Material& material)
{
    if (texture.slot == &Material::base_color_texture) return true;
    if (material.unlit) return false;
    if (texture.slot == &Material::emission_texture) return material.emission != glm::vec3(0.0f);
    return !texture.hidden_by || material.*texture.hidden_by > 0.0f;
}

void read_textures(const Factors& factors, TextureReader& textures, Material& material)
{
    const TextureUses uses = texture_uses(factors.source);
    const UvSets sets = uv_sets_of(factors.source);
    for (std::size_t i = 0; i < kTextures; ++i) {
        const MaterialTexture& t = kMaterialTextures[i];
        if (is_seen(t, material)) material.*t.slot = textures.read(uses[i], t.space, sets, factors.what, factors.name);
    }
}

/// The material's base in other words, which stand instead of glTF's own.
void read_specular_glossiness(const Factors& factors, TextureReader& textures, Material& material)
{
    constexpr const char* kName = "KHR_materials_pbrSpecularGlossiness";
    if (factors.source.extensions.count(kName) == 0 || material.unlit) return;
    const tinygltf::Value& values = extension_of(factors.source, kName);
    const auto number = [&](const char* key, int channel) {
        const double value = values.Has(key) ? values.Get(key).Get(channel).GetNumberAsDouble() : 1.0;
        return factors.clamped(key, value, 0.0, 1.0);
    };
    const auto color = [&](const char* key) { return glm::vec3(number(key, 0), number(key, 1), number(key, 2)); };
    const auto read = [&](const char* key) {
        return textures.read(texture_use(values, key), ColorSpace::srgb, uv_sets_of(factors.source), factors.what,
                             factors.name);
    };
    SpecularGlossiness from;
    from.diffuse = color("diffuseFactor");
    material.alpha = number("diffuseFactor", 3);
    from.specular = color("specularFactor");
    from.glossiness = factors.clamped("glossinessFactor", factors.of(kName, "glossinessFactor", 1.0), 0.0, 1.0);
    from.diffuse_texture = read("diffuseTexture");
    from.specular_texture = read("specularGlossinessTexture");
    if (!set_specular_glossiness(from, textures, factors.what, material))
        factors.file.notes->add(kMappedUnlike, factors.name);
}

Material read_material(const Factors& factors, TextureReader& textures)
{
    const tinygltf::Material& source = factors.source;
    Material material;
    material.double_sided = source.doubleSided;
    read_base_color(factors, material);
    material.metallic = factors.clamped("metallicFactor", source.pbrMetallicRoughness.metallicFactor, 0.0, 1.0);
    material.roughness = factors.clamped("roughnessFactor", source.pbrMetallicRoughness.roughnessFactor, 0.0, 1.0);
    material.normal_scale = factors.clamped("scale", source.normalTexture.scale, -kAnyFactor, kAnyFactor);
    read_alpha_mode(factors, material);
    read_extensions(factors, material);
    material.emission = material.unlit ? glm::vec3(0.0f) : read_emission(factors);
    read_textures(factors, textures, material);
    read_specular_glossiness(factors, textures, material);
    return material;
}

}  // namespace

void read_materials(const GltfFile& file, const tinygltf::Model& model, const std::vector<bool>& in_use, Scene& scene)
{
    TextureReader textures(file, model, scene);
    for (std::size_t i = 0; i < model.materials.size(); ++i) {
        const tinygltf::Material& source = model.materials[i];
        Material material;
        if (in_use[i]) {
            material = read_material(
                {file, source, short_name(i, source.name), element_name("material", i, source.name)}, textures);
        }
        material.name = source.name;
        scene.materials.push_back(std::move(material));
    }
}

Material default_gltf_material()
{
    Material material;
    material.name = "default";
    material.metallic = 1.0f;
    material.specular = 1.0f;
    return material;
}

UvSets uv_sets_of(const tinygltf::Material& material)
{
    UvSets sets = {-1, -1};
    bool beyond = false;
    for (const TextureUse& use : texture_uses(material)) {
        if (use.texture < 0 || use.uv_set == sets[0] || use.uv_set == sets[1]) continue;
        beyond = beyond || use.uv_set > 1;
        if (sets[0] < 0)
            sets[0] = use.uv_set;
        else if (sets[1] < 0)
            sets[1] = use.uv_set;
    }
    return beyond ? sets : UvSets{0, 1};
}

bool uses_uv_set(const tinygltf::Material& material, int uv_set)
{
    const TextureUses uses = texture_uses(material);
    return std::any_of(uses.begin(), uses.end(),
                       [&](const TextureUse& use) { return use.texture >= 0 && use.uv_set == uv_set; });
}

std::optional<TextureUse> tangent_texture_use(const tinygltf::Material& material)
{
    const TextureUse normal = core_texture_use(material, "normalTexture");
    if (normal.texture >= 0) return normal;
    const auto anisotropy = material.extensions.find("KHR_materials_anisotropy");
    if (anisotropy == material.extensions.end()) return std::nullopt;
    const TextureUse direction = texture_use(anisotropy->second, "anisotropyTexture");
    return direction.texture >= 0 ? direction : TextureUse{};
}

}  // namespace rcs
