#include "scene/gltf_material.h"

#include <cmath>
#include <map>
#include <string>

#include "scene/gltf_accessor.h"
#include "scene/image_decoder.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kGlossy{"metallic or glossy reflection", "material",
                               "rendered as Lambertian with the base colour"};
constexpr GltfNoteKind kClamped{"base colour outside [0, 1]", "material", "clamped"};
constexpr GltfNoteKind kEmissiveTexture{"emissive textures", "material", "rendered without emission"};
constexpr GltfNoteKind kNormalTexture{"normal textures", "material", "ignored"};
constexpr GltfNoteKind kOcclusionTexture{"occlusion textures", "material", "ignored"};
constexpr GltfNoteKind kAlpha{"transparency", "material", "rendered opaque"};
constexpr GltfNoteKind kWrap{"texture wrap modes other than repeat", "material", "repeated"};
constexpr GltfNoteKind kNoImage{"a base colour texture without an image that this build reads", "material",
                                "the base colour factor alone is used"};

/// Textures read so far, by image; -1 marks none.
using TextureOfImage = std::map<int, int>;

Texture read_image(const GltfFile& file, const tinygltf::Model& model, int index)
{
    const tinygltf::Image& image = model.images[static_cast<std::size_t>(index)];
    const std::string what = element_name("image", static_cast<std::size_t>(index),
                                          image.name.empty() ? image.uri.substr(0, 80) : image.name);
    const std::string where = file.path + ": " + what;
    const std::string name = short_name(static_cast<std::size_t>(index), image.name.empty() ? image.uri : image.name);
    if (image.bufferView >= 0) return decode_texture(view_bytes(file, model, image.bufferView, what), name, where);
    if (!image.image.empty()) return decode_texture(image.image, name, where);
    return decode_texture(read_file(external_path(file, image.uri, what), where), name, where);
}

bool repeats(const tinygltf::Model& model, const tinygltf::Texture& texture)
{
    if (texture.sampler < 0 || static_cast<std::size_t>(texture.sampler) >= model.samplers.size()) return true;
    const tinygltf::Sampler& sampler = model.samplers[static_cast<std::size_t>(texture.sampler)];
    return sampler.wrapS == TINYGLTF_TEXTURE_WRAP_REPEAT && sampler.wrapT == TINYGLTF_TEXTURE_WRAP_REPEAT;
}

/// @return index into scene.textures, or -1
int base_color_texture(const GltfFile& file, const tinygltf::Model& model, const tinygltf::Material& material,
                       const std::string& name, Scene& scene, TextureOfImage& known)
{
    const int index = material.pbrMetallicRoughness.baseColorTexture.index;
    if (index < 0) return -1;
    if (static_cast<std::size_t>(index) >= model.textures.size()) {
        bad_file(file, "material '" + name + "' names texture " + std::to_string(index) + ", the file has " +
                           std::to_string(model.textures.size()));
    }
    const tinygltf::Texture& texture = model.textures[static_cast<std::size_t>(index)];
    if (texture.source < 0 || static_cast<std::size_t>(texture.source) >= model.images.size()) {
        file.notes->add(kNoImage, name);
        return -1;
    }
    if (!repeats(model, texture)) file.notes->add(kWrap, name);
    const auto [entry, is_new] = known.try_emplace(texture.source, static_cast<int>(scene.textures.size()));
    if (is_new) scene.textures.push_back(read_image(file, model, texture.source));
    return entry->second;
}

void note_what_is_left_out(const GltfFile& file, const tinygltf::Material& material, const std::string& name)
{
    const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
    if (pbr.metallicFactor > 0.0 || pbr.roughnessFactor < 1.0 || pbr.metallicRoughnessTexture.index >= 0) {
        file.notes->add(kGlossy, name);
    }
    if (material.normalTexture.index >= 0) file.notes->add(kNormalTexture, name);
    if (material.occlusionTexture.index >= 0) file.notes->add(kOcclusionTexture, name);
    if (material.alphaMode != "OPAQUE") file.notes->add(kAlpha, name);
}

glm::vec3 base_color(const GltfFile& file, const tinygltf::Material& material, const std::string& name)
{
    const std::vector<double>& factor = material.pbrMetallicRoughness.baseColorFactor;
    if (factor.size() < 3) bad_file(file, "material '" + name + "' has a baseColorFactor of fewer than 3 numbers");
    const glm::dvec3 asked(factor[0], factor[1], factor[2]);
    const glm::dvec3 color = glm::clamp(asked, 0.0, 1.0);
    if (color != asked) file.notes->add(kClamped, name);
    return glm::vec3(color);
}

/// KHR_materials_emissive_strength: a factor on emissiveFactor.
double emissive_strength(const tinygltf::Material& material)
{
    const auto found = material.extensions.find("KHR_materials_emissive_strength");
    if (found == material.extensions.end() || !found->second.Has("emissiveStrength")) return 1.0;
    const tinygltf::Value& strength = found->second.Get("emissiveStrength");
    return strength.IsNumber() ? strength.GetNumberAsDouble() : 1.0;
}

glm::vec3 emission(const GltfFile& file, const tinygltf::Material& material, const std::string& name)
{
    const std::vector<double>& factor = material.emissiveFactor;
    if (factor.size() < 3) return glm::vec3(0.0f);
    const glm::vec3 radiance = glm::dvec3(factor[0], factor[1], factor[2]) * emissive_strength(material);
    if (radiance == glm::vec3(0.0f)) return radiance;
    for (int channel = 0; channel < 3; ++channel) {
        if (!(radiance[channel] >= 0.0f) || !std::isfinite(radiance[channel])) {
            bad_file(file, "material '" + name + "' emits " + std::to_string(radiance[channel]) +
                               ", expected a finite radiance >= 0");
        }
    }
    // The factor alone would make the whole surface glow where the file means its lit parts.
    if (material.emissiveTexture.index >= 0) {
        file.notes->add(kEmissiveTexture, name);
        return glm::vec3(0.0f);
    }
    return radiance;
}

}  // namespace

void read_materials(const GltfFile& file, const tinygltf::Model& model, const std::vector<bool>& in_use, Scene& scene)
{
    TextureOfImage known;
    for (std::size_t i = 0; i < model.materials.size(); ++i) {
        const tinygltf::Material& source = model.materials[i];
        const std::string name = short_name(i, source.name);
        Material material;
        material.name = source.name;
        material.double_sided = source.doubleSided;
        if (in_use[i]) {
            note_what_is_left_out(file, source, name);
            material.base_color = base_color(file, source, name);
            material.emission = emission(file, source, name);
            material.base_color_texture.texture = base_color_texture(file, model, source, name, scene, known);
        }
        scene.materials.push_back(std::move(material));
    }
}

bool keep_encoded_image(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes,
                        int size, void*)
{
    if (image->bufferView < 0) image->image.assign(bytes, bytes + size);
    return true;
}

}  // namespace rcs
