#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "rcs/scene.h"
#include "scene/gltf_document.h"
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

/// A property of the file that an animation gives another value (KHR_animation_pointer).
struct PosedProperty {
    std::string pointer;  ///< JSON pointer (RFC 6901) into the file
    Json value;
    std::string what;  ///< gives it: "animation 0 'blink', channel 2"
};

struct GltfPose {
    std::vector<NodePose> nodes;  ///< one per node
    std::vector<PosedProperty> properties;
};

/// Writes them into the file. @throws Error bad_file: a pointer to nothing
void set_properties(GltfDocument& document, const std::vector<PosedProperty>& properties);

/// The file's animations at a time [s], held at the first and last keyframe outside of them. They play
/// together; one that moves what an earlier one moves is left out (a walk and a run) with a note.
/// @param options  of no time: the rest pose, that of nodes and properties by themselves
/// @throws Error bad_file; not_found: an animation that the file does not have
GltfPose pose_at(const GltfFile& file, const tinygltf::Model& model, const LoadOptions& options);

}  // namespace rcs
