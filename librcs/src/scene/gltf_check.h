#pragma once

#include <vector>

#include "scene/gltf_file.h"

namespace rcs {

/// Looks at a .gltf or .glb file before tinygltf does, which trusts a file in places: everything that it
/// would follow without a check (chunk lengths, buffer views, Draco attributes) is checked here.
/// @throws Error bad_file, unsupported
void check_gltf(const GltfFile& file, const std::vector<unsigned char>& bytes);

/// Whether the bytes begin like a .glb file.
bool is_glb(const std::vector<unsigned char>& bytes);

}  // namespace rcs
