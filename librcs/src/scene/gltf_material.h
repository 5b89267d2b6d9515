#pragma once

#include <vector>

#include "rcs/scene.h"
#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Fills scene.materials, in the file's order, and scene.textures. Images are decoded only for
/// materials that are in use; the others keep their defaults.
/// @param in_use  one per material of the file
/// @throws Error bad_file, not_found, unsupported
void read_materials(const GltfFile& file, const tinygltf::Model& model, const std::vector<bool>& in_use,
                    Scene& scene);

/// tinygltf's image loader: keeps the encoded bytes of images that the file embeds as text. Images in
/// buffer views and in files of their own are left where they are until they are known to be needed.
bool keep_encoded_image(tinygltf::Image* image, int index, std::string* error, std::string* warning, int width,
                        int height, const unsigned char* bytes, int size, void* user);

}  // namespace rcs
