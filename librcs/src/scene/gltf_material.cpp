#include "scene/gltf_material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace rcs {
namespace {

constexpr GltfNoteKind kClampedColor{"base colour outside [0, 1]", "material", "clamped"};
constexpr GltfNoteKind kClamped{"values outside their range", "material", "clamped"};
constexpr GltfNoteKind kClearcoatNormal{"clearcoat normal textures", "material", "ignored"};
constexpr GltfNoteKind kAlphaMode{"an alpha mode that glTF does not have", "material", "rendered opaque"};

/// Where a material may name a texture. `occlusionTexture` is not among them: the renderer computes occlusion.
enum Slot {
    base_color,
    metallic_roughness,
    normal,
    emission,
    specular,
    specular_color,
    transmission,
    clearcoat,
    clearcoat_roughness,
    slot_count
};

using TextureUses = std::array<TextureUse, slot_count>;

const tinygltf::Value& extension_of(const tinygltf::Material& material, const char* name)
{
    static const tinygltf::Value none;
    const auto found = material.extensions.find(name);
    return found == material.extensions.end() ? none : found->second;
}

TextureUses texture_uses(const tinygltf::Material& material)
{
    const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
    const auto use = [](const auto& info) { return texture_use(info.index, info.texCoord, info.extensions); };
    const tinygltf::Value& reflection = extension_of(material, "KHR_materials_specular");
    const tinygltf::Value& coat = extension_of(material, "KHR_materials_clearcoat");
    TextureUses uses;
    uses[base_color] = use(pbr.baseColorTexture);
    uses[metallic_roughness] = use(pbr.metallicRoughnessTexture);
    uses[normal] = use(material.normalTexture);
    uses[emission] = use(material.emissiveTexture);
    uses[specular] = texture_use(reflection, "specularTexture");
    uses[specular_color] = texture_use(reflection, "specularColorTexture");
    uses[transmission] = texture_use(extension_of(material, "KHR_materials_transmission"), "transmissionTexture");
    uses[clearcoat] = texture_use(coat, "clearcoatTexture");
    uses[clearcoat_roughness] = texture_use(coat, "clearcoatRoughnessTexture");
    return uses;
}

/// Reads the numbers of one material.
struct Factors {
    const GltfFile& file;
    const tinygltf::Material& source;
    std::string name;  ///< for notes
    std::string what;  ///< for messages

    float clamped(double value, double least, double most, const GltfNoteKind& kind = kClamped) const
    {
        const double result = std::clamp(value, least, most);
        if (result != value) file.notes->add(kind, name);
        return static_cast<float>(result);
    }

    double of(const char* extension, const char* key, double missing) const
    {
        const tinygltf::Value& values = extension_of(source, extension);
        return values.Has(key) ? values.Get(key).GetNumberAsDouble() : missing;
    }

    glm::dvec3 color_of(const char* extension, const char* key) const
    {
        const tinygltf::Value& values = extension_of(source, extension);
        if (!values.Has(key)) return glm::dvec3(1.0);
        const tinygltf::Value& color = values.Get(key);
        return {color.Get(0).GetNumberAsDouble(), color.Get(1).GetNumberAsDouble(), color.Get(2).GetNumberAsDouble()};
    }
};

void read_base_color(const Factors& factors, Material& material)
{
    const std::vector<double>& factor = factors.source.pbrMetallicRoughness.baseColorFactor;
    const glm::dvec3 asked(factor.at(0), factor.at(1), factor.at(2));
    material.base_color = glm::vec3(glm::clamp(asked, 0.0, 1.0));
    if (glm::clamp(asked, 0.0, 1.0) != asked) factors.file.notes->add(kClampedColor, factors.name);
    material.alpha = factors.clamped(factor.at(3), 0.0, 1.0);
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
    material.alpha_cutoff = factors.clamped(factors.source.alphaCutoff, 0.0, 2.0);
}

void read_extensions(const Factors& factors, Material& material)
{
    constexpr double kLarge = 1e4;  // an index of refraction or a tint beyond it reflects all
    // 0 stands for a mirror that no index of refraction gives (KHR_materials_ior).
    const double ior = factors.of("KHR_materials_ior", "ior", 1.5);
    material.ior = ior == 0.0 ? static_cast<float>(kLarge) : factors.clamped(ior, 1.0, kLarge);
    material.specular = factors.clamped(factors.of("KHR_materials_specular", "specularFactor", 1.0), 0.0, 1.0);
    const glm::dvec3 tint = factors.color_of("KHR_materials_specular", "specularColorFactor");
    for (int i = 0; i < 3; ++i) material.specular_color[i] = factors.clamped(tint[i], 0.0, kLarge);
    material.transmission =
        factors.clamped(factors.of("KHR_materials_transmission", "transmissionFactor", 0.0), 0.0, 1.0);
    material.clearcoat = factors.clamped(factors.of("KHR_materials_clearcoat", "clearcoatFactor", 0.0), 0.0, 1.0);
    material.clearcoat_roughness =
        factors.clamped(factors.of("KHR_materials_clearcoat", "clearcoatRoughnessFactor", 0.0), 0.0, 1.0);
    if (extension_of(factors.source, "KHR_materials_clearcoat").Has("clearcoatNormalTexture")) {
        factors.file.notes->add(kClearcoatNormal, factors.name);
    }
    material.unlit = factors.source.extensions.count("KHR_materials_unlit") > 0;
}

void read_textures(const Factors& factors, TextureReader& textures, Material& material)
{
    const TextureUses uses = texture_uses(factors.source);
    const UvSets sets = uv_sets_of(factors.source);
    const auto read = [&](Slot slot, ColorSpace space) {
        return textures.read(uses[slot], space, sets, factors.what, factors.name);
    };
    material.base_color_texture = read(base_color, ColorSpace::srgb);
    if (material.unlit) return;
    material.metallic_roughness_texture = read(metallic_roughness, ColorSpace::linear);
    material.normal_texture = read(normal, ColorSpace::linear);
    // What a factor of 0 hides is not worth its memory.
    if (material.emission != glm::vec3(0.0f)) material.emission_texture = read(emission, ColorSpace::srgb);
    material.specular_texture = read(specular, ColorSpace::linear);
    material.specular_color_texture = read(specular_color, ColorSpace::srgb);
    if (material.transmission > 0.0f) material.transmission_texture = read(transmission, ColorSpace::linear);
    if (material.clearcoat > 0.0f) {
        material.clearcoat_texture = read(clearcoat, ColorSpace::linear);
        material.clearcoat_roughness_texture = read(clearcoat_roughness, ColorSpace::linear);
    }
}

Material read_material(const Factors& factors, TextureReader& textures)
{
    const tinygltf::Material& source = factors.source;
    Material material;
    material.double_sided = source.doubleSided;
    read_base_color(factors, material);
    material.metallic = factors.clamped(source.pbrMetallicRoughness.metallicFactor, 0.0, 1.0);
    material.roughness = factors.clamped(source.pbrMetallicRoughness.roughnessFactor, 0.0, 1.0);
    constexpr double kSteepest = 1e6;
    material.normal_scale = factors.clamped(source.normalTexture.scale, -kSteepest, kSteepest);
    read_alpha_mode(factors, material);
    read_extensions(factors, material);
    material.emission = material.unlit ? glm::vec3(0.0f) : read_emission(factors);
    read_textures(factors, textures, material);
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

TextureUse normal_texture_use(const tinygltf::Material& material) { return texture_uses(material)[normal]; }

bool leave_image(tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int, void*)
{
    return true;
}

}  // namespace rcs
