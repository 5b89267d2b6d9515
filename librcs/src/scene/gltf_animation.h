#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// What an animation puts in the place of a node's own values.
struct NodePose {
    std::optional<glm::dvec3> translation;
    std::optional<glm::dquat> rotation;  ///< unit
    std::optional<glm::dvec3> scale;
    std::vector<double> weights;  ///< of morph targets; empty: not animated

    bool moves() const { return translation || rotation || scale; }
};

/// The file's animations at a time [s], held at the first and last keyframe outside of them. They play
/// together; one that moves what an earlier one moves is left out (a walk and a run) with a note.
/// @return one per node
/// @throws Error bad_file
std::vector<NodePose> pose_at(const GltfFile& file, const tinygltf::Model& model, double time);

}  // namespace rcs
