#pragma once

#include <cstddef>
#include <optional>

#include "rcs/scene.h"
#include "scene/gltf_deform.h"
#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Reads one primitive: lists, strips and fans become triangles, triangles without area are dropped,
/// damaged normals are replaced by those of the faces. The material is left at 0. Meshes with a normal texture
/// get tangents.
/// @param deformation  with weights for each morph target, or none
/// @return empty if nothing of it can be seen (points, lines, no triangles)
/// @throws Error bad_file, unsupported
std::optional<Mesh> read_primitive(const GltfFile& file, const tinygltf::Model& model, std::size_t mesh,
                                   std::size_t primitive, const Deformation& deformation);

}  // namespace rcs
