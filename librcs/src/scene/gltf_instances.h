#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/scene.h"
#include "scene/gltf_animation.h"
#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// One entry per node, empty if it is not part of the scene.
using Matrices = std::vector<std::optional<glm::dmat4>>;

/// Adds the meshes that nodes show, posed, and an instance for each place where they do. Nodes that show
/// a mesh in the same way share it. A mesh's material is its number in the file, -1 if it has none.
/// @param visible  whether a node shows its mesh   @throws Error bad_file, unsupported
void add_instances(const GltfFile& file, const tinygltf::Model& model, const Matrices& matrices,
                   const std::vector<NodePose>& poses, const std::vector<bool>& visible, Scene& scene);

}  // namespace rcs
