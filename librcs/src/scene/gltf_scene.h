#pragma once

#include <vector>

#include "rcs/scene.h"
#include "scene/gltf_animation.h"
#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Turns what tinygltf read into a scene: nodes become instances, lights and cameras in world space,
/// which is then moved by Scene::origin. A file without a camera gets none.
/// @param poses  one per node
/// @throws Error bad_file, not_found, unsupported
Scene build_scene(const GltfFile& file, const tinygltf::Model& model, const std::vector<NodePose>& poses);

}  // namespace rcs
