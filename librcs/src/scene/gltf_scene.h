#pragma once

#include <optional>

#include "rcs/scene.h"
#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// Turns what tinygltf read into a scene: nodes become instances, lights and cameras in world space,
/// which is then moved by Scene::origin. A file without a camera gets none.
/// @param time  [s] of its animations; none: the pose that the nodes themselves have
/// @throws Error bad_file, not_found, unsupported
Scene build_scene(const GltfFile& file, const tinygltf::Model& model, std::optional<double> time);

}  // namespace rcs
