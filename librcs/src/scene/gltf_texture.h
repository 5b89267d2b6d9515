#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <glm/glm.hpp>

#include "rcs/scene.h"
#include "scene/gltf_file.h"
#include "scene/image_decoder.h"
#include "scene/tinygltf.h"

namespace rcs {

/// A textureInfo: which texture a material uses, and how it is mapped.
struct TextureUse {
    int texture = -1;  ///< index into the file's textures, -1: none
    int uv_set = 0;    ///< n of TEXCOORD_n
    glm::mat3x2 texture_from_uv{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f};
};
TextureUse texture_use(int index, int uv_set, const tinygltf::ExtensionMap& extensions);
/// A textureInfo inside a material's extension. @param info  its parent object
TextureUse texture_use(const tinygltf::Value& parent, const char* key);

/// The uv sets of a file that become Mesh::uvs and Mesh::uvs1; -1: none.
using UvSets = std::array<int, 2>;

/// Reads the textures that materials use into scene.textures; each image once a colour space.
class TextureReader {
public:
    TextureReader(const GltfFile& file, const tinygltf::Model& model, Scene& scene)
        : file_(file), model_(model), scene_(scene)
    {
    }
    /// @param user  names the material in messages  @param name  the same in notes
    /// @throws Error bad_file, not_found, unsupported
    TextureSlot read(const TextureUse& use, ColorSpace space, const UvSets& uv_sets, const std::string& user,
                     const std::string& name);

    /// Adds a texture that was made from ones that it has read. @return its number   @throws Error unsupported
    int keep(Texture made, const std::string& user);

    const Scene& scene() const { return scene_; }

private:
    int image_of(const tinygltf::Texture& texture, const std::string& what, const std::string& name) const;
    void set_sampler(const tinygltf::Texture& texture, const std::string& what, TextureSlot& slot) const;
    Texture read_image(int index, ColorSpace space);
    Texture shared_texture(const std::string& content) const;

    const GltfFile& file_;
    const tinygltf::Model& model_;
    Scene& scene_;
    std::map<std::pair<int, ColorSpace>, int> known_;  ///< by image
    std::int64_t texels_ = 0;                          ///< read so far
};

}  // namespace rcs
