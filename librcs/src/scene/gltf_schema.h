#pragma once

#include "scene/gltf_document.h"

namespace rcs {

/// Checks the JSON types and array lengths of what is read from nodes, meshes, materials, textures, skins,
/// animations, cameras and lights: tinygltf takes a default for a member of another type and says nothing.
/// @throws Error bad_file  names element and member
void check_types(const GltfDocument& document);

}  // namespace rcs
