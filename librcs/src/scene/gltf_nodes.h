#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// The matrix of each node that belongs to the file's default scene (of all nodes, if it has none);
/// empty for the others.
/// @throws Error bad_file  for a cycle, a node with two parents, a matrix that is not finite and affine
std::vector<std::optional<glm::dmat4>> node_matrices(const GltfFile& file, const tinygltf::Model& model);

/// Whether the matrix flattens what it transforms: its inverse is lost in rounding.
bool is_singular(const glm::dmat4& matrix);

}  // namespace rcs
