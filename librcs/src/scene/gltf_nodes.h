#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "scene/gltf_animation.h"
#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// The matrix of each node that belongs to the file's default scene (of all nodes, if it has none);
/// empty for the others.
/// @param poses  one per node: what takes the place of its own values
/// @throws Error bad_file  for a cycle, a node with two parents, a matrix that is not finite and affine
std::vector<std::optional<glm::dmat4>> node_matrices(const GltfFile& file, const tinygltf::Model& model,
                                                     const std::vector<NodePose>& poses);

/// Which nodes show what they carry: neither they nor a node above them is hidden (KHR_node_visibility).
/// @param model  whose matrices are known: its nodes have children that there are
std::vector<bool> visible_nodes(const tinygltf::Model& model);

/// @param what  has that matrix   @throws Error bad_file  unless all its entries are within 1e18 of zero
void check_entries(const GltfFile& file, const std::string& what, const glm::dmat4& matrix);
/// @throws Error bad_file  unless the matrix of that node is finite and affine
void check_matrix(const GltfFile& file, const tinygltf::Model& model, std::size_t node, const glm::dmat4& matrix);

inline constexpr GltfNoteKind kSingularNode{"a matrix that flattens space", "node", "left out"};

/// Whether the matrix flattens what it transforms: its inverse is lost in rounding.
bool is_singular(const glm::dmat4& matrix);

}  // namespace rcs
