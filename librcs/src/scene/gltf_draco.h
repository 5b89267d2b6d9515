#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <draco/mesh/mesh.h>

#include "scene/gltf_file.h"

namespace rcs {

/// Decodes a mesh of KHR_draco_mesh_compression, whose bitstream is version 2.2.
/// @param file, what  whose data they are, for the message
/// @throws Error bad_file: another version, damaged, or so large a mesh that so few bytes cannot hold it
std::unique_ptr<draco::Mesh> decode_draco(const GltfFile& file, const std::string& what, const char* bytes,
                                          std::size_t size);

}  // namespace rcs
