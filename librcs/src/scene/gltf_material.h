#pragma once

#include <optional>
#include <vector>

#include "rcs/scene.h"
#include "scene/gltf_file.h"
#include "scene/gltf_texture.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Fills scene.materials, in the file's order, and scene.textures. Images are decoded only for
/// materials that are in use; the others keep their defaults.
/// @param in_use  one per material of the file
/// @throws Error bad_file, not_found, unsupported
void read_materials(const GltfFile& file, const tinygltf::Model& model, const std::vector<bool>& in_use, Scene& scene);

/// A surface as glTF means it where a file says nothing: a rough white metal.
Material default_gltf_material();

/// The uv sets that the material's textures use: 0 and 1 unless it asks for others.
UvSets uv_sets_of(const tinygltf::Material& material);

/// Whether a texture of the material uses that set, one of uv_sets_of().
bool uses_uv_set(const tinygltf::Material& material, int uv_set);

/// The texture whose coordinates tangents follow; none: the material needs no tangents.
std::optional<TextureUse> tangent_texture_use(const tinygltf::Material& material);

}  // namespace rcs
