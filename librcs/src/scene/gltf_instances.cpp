#include "scene/gltf_instances.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "scene/gltf_accessor.h"
#include "scene/gltf_deform.h"
#include "scene/gltf_mesh.h"
#include "scene/gltf_nodes.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kBadRotation{"instance rotations of length 0", "node", "left unturned"};

/// A mesh as a node shows it: the file's mesh, its morph weights, and the skinned node (-1: no skin).
struct Shown {
    std::size_t mesh = 0;
    std::vector<double> weights;
    int skinned_node = -1;

    auto operator<=>(const Shown&) const = default;
};

struct Placing {
    const GltfFile& file;
    const tinygltf::Model& model;
    const Matrices& matrices;
    Scene& scene;
    std::map<Shown, std::vector<int>> meshes = {};  ///< numbers of those made so far

    std::string name_of(std::size_t node) const { return element_name("node", node, model.nodes[node].name); }
    /// The same for every pose of the file.
    std::string instance_name(std::size_t node) const
    {
        const std::string& own = model.nodes[node].name;
        return own.empty() ? "node " + std::to_string(node) : own;
    }
};

std::span<const int> meshes_of(Placing& placing, const Shown& shown, std::vector<glm::dmat4> joints)
{
    const auto [entry, is_new] = placing.meshes.try_emplace(shown);
    if (!is_new) return entry->second;
    const tinygltf::Mesh& source = placing.model.meshes[shown.mesh];
    const Deformation deformation{shown.weights, std::move(joints)};
    for (std::size_t i = 0; i < source.primitives.size(); ++i) {
        const int material = source.primitives[i].material;
        if (material >= 0 && static_cast<std::size_t>(material) >= placing.model.materials.size()) {
            bad_file(placing.file, element_name("mesh", shown.mesh, source.name) + " names material " +
                                       std::to_string(material) + ", the file has " +
                                       std::to_string(placing.model.materials.size()));
        }
        std::optional<Mesh> mesh = read_primitive(placing.file, placing.model, shown.mesh, i, deformation);
        if (!mesh) continue;
        mesh->material = material;
        entry->second.push_back(static_cast<int>(placing.scene.meshes.size()));
        placing.scene.meshes.push_back(std::move(*mesh));
    }
    return entry->second;
}

/// Morph weights of a node, empty if none is in effect: its pose's, else its own, else its mesh's.
std::vector<double> weights_of(const tinygltf::Node& node, const tinygltf::Mesh& mesh, const NodePose& pose)
{
    const std::vector<double>& own = node.weights.empty() ? mesh.weights : node.weights;
    const std::vector<double>& weights = pose.weights.empty() ? own : pose.weights;
    const bool in_effect = std::any_of(weights.begin(), weights.end(), [](double weight) { return weight != 0.0; });
    return in_effect ? weights : std::vector<double>{};
}

/// Where each joint of the node's skin moves the mesh, in world space.
std::vector<glm::dmat4> joints_of(const Placing& placing, std::size_t node)
{
    const int number = placing.model.nodes[node].skin;
    if (static_cast<std::size_t>(number) >= placing.model.skins.size()) {
        bad_file(placing.file, placing.name_of(node) + " names skin " + std::to_string(number) + ", the file has " +
                                   std::to_string(placing.model.skins.size()));
    }
    const auto index = static_cast<std::size_t>(number);
    const tinygltf::Skin& skin = placing.model.skins[index];
    const std::string what = element_name("skin", index, skin.name);
    std::vector<glm::mat4> inverse_bind(skin.joints.size(), glm::mat4(1.0f));
    if (skin.inverseBindMatrices >= 0) {
        inverse_bind = read_mat4(placing.file, placing.model, skin.inverseBindMatrices, what + ", inverseBindMatrices");
    }
    if (skin.joints.empty() || inverse_bind.size() < skin.joints.size()) {
        bad_file(placing.file, what + " has " + std::to_string(skin.joints.size()) + " joints and " +
                                   std::to_string(inverse_bind.size()) + " inverse bind matrices");
    }
    std::vector<glm::dmat4> joints;
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
        const int joint = skin.joints[i];
        if (joint < 0 || static_cast<std::size_t>(joint) >= placing.matrices.size() ||
            !placing.matrices[static_cast<std::size_t>(joint)]) {
            bad_file(placing.file,
                     what + " names the joint " + std::to_string(joint) + ", which is no node of the scene");
        }
        joints.push_back(*placing.matrices[static_cast<std::size_t>(joint)] * glm::dmat4(inverse_bind[i]));
        check_entries(placing.file, what + ", joint " + std::to_string(i) + " with its inverse bind matrix",
                      joints.back());
    }
    return joints;
}

/// glTF 2.0, section 3.7.3.3: the joints alone place a skinned mesh, its node's matrix does not count.
void add_skinned(Placing& placing, std::size_t node, Shown shown)
{
    std::vector<glm::dmat4> joints = joints_of(placing, node);
    // Vertices stay near zero, where floats are fine, and the instance carries them to their place.
    const glm::dvec3 place = joints.front()[3];
    for (glm::dmat4& joint : joints) joint = glm::translate(glm::dmat4(1.0), -place) * joint;
    shown.skinned_node = static_cast<int>(node);
    const std::span<const int> meshes = meshes_of(placing, shown, std::move(joints));
    for (const int mesh : meshes) {
        placing.scene.instances.push_back({placing.instance_name(node), mesh, glm::translate(glm::dmat4(1.0), place)});
    }
}

/// @return -1 if there is none of that name
int instancing_accessor(const tinygltf::Value& attributes, const char* name)
{
    return attributes.Has(name) && attributes.Get(name).IsInt() ? attributes.Get(name).GetNumberAsInt() : -1;
}

/// The places of EXT_mesh_gpu_instancing in the space of its node; one of no effect for other nodes.
std::vector<glm::dmat4> instance_matrices(const Placing& placing, std::size_t node)
{
    const tinygltf::ExtensionMap& extensions = placing.model.nodes[node].extensions;
    const auto found = extensions.find("EXT_mesh_gpu_instancing");
    if (found == extensions.end()) return {glm::dmat4(1.0)};
    const std::string what = placing.name_of(node) + ", EXT_mesh_gpu_instancing";
    if (!found->second.Has("attributes") || !found->second.Get("attributes").IsObject()) {
        bad_file(placing.file, what + " has no attributes");
    }
    const tinygltf::Value& attributes = found->second.Get("attributes");
    const int translations = instancing_accessor(attributes, "TRANSLATION");
    const int rotations = instancing_accessor(attributes, "ROTATION");
    const int scales = instancing_accessor(attributes, "SCALE");
    std::size_t count = 0;
    bool any = false;
    for (const int accessor : {translations, rotations, scales}) {
        if (accessor < 0) continue;
        const std::size_t own = accessor_count(placing.file, placing.model, accessor, what);
        if (any && own != count) {
            bad_file(placing.file, what + " has attributes of " + std::to_string(count) + " and " +
                                       std::to_string(own) + " elements");
        }
        count = own;
        any = true;
    }
    if (!any) return {glm::dmat4(1.0)};

    // Each reader checks that as many elements lie in the file.
    std::vector<glm::vec3> moves, sizes;
    std::vector<glm::vec4> turns;
    if (translations >= 0) moves = read_vec3(placing.file, placing.model, translations, what + ", TRANSLATION");
    if (rotations >= 0) turns = read_vec4(placing.file, placing.model, rotations, what + ", ROTATION");
    if (scales >= 0) sizes = read_vec3(placing.file, placing.model, scales, what + ", SCALE");
    std::vector<glm::dmat4> matrices(count, glm::dmat4(1.0));
    std::size_t unturned = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (!moves.empty()) matrices[i] = glm::translate(matrices[i], glm::dvec3(moves[i]));
        if (!turns.empty()) {
            const glm::dquat turn(turns[i].w, turns[i].x, turns[i].y, turns[i].z);
            const double length = glm::length(turn);
            if (length > 0.0)
                matrices[i] *= glm::mat4_cast(turn / length);
            else
                ++unturned;
        }
        if (!sizes.empty()) matrices[i] = glm::scale(matrices[i], glm::dvec3(sizes[i]));
    }
    if (unturned > 0) {
        placing.file.notes->add(kBadRotation, short_name(node, placing.model.nodes[node].name), unturned);
    }
    return matrices;
}

void add_rigid(Placing& placing, std::size_t node, const Shown& shown)
{
    const std::string& name = placing.model.nodes[node].name;
    const std::vector<glm::dmat4> places = instance_matrices(placing, node);
    bool flattened = false;
    for (const glm::dmat4& place : places) {
        const glm::dmat4 matrix = *placing.matrices[node] * place;
        check_matrix(placing.file, placing.model, node, matrix);
        if (is_singular(matrix)) {
            flattened = true;
            continue;
        }
        const std::span<const int> meshes = meshes_of(placing, shown, {});
        for (const int mesh : meshes) placing.scene.instances.push_back({placing.instance_name(node), mesh, matrix});
    }
    if (flattened) placing.file.notes->add(kSingularNode, short_name(node, name));
}

}  // namespace

void add_instances(const GltfFile& file, const tinygltf::Model& model, const Matrices& matrices,
                   const std::vector<NodePose>& poses, const std::vector<bool>& visible, Scene& scene)
{
    Placing placing{file, model, matrices, scene};
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        const tinygltf::Node& node = model.nodes[i];
        if (!matrices[i] || !visible[i] || node.mesh < 0) continue;
        if (static_cast<std::size_t>(node.mesh) >= model.meshes.size()) {
            bad_file(file, placing.name_of(i) + " names mesh " + std::to_string(node.mesh) + ", the file has " +
                               std::to_string(model.meshes.size()));
        }
        const auto mesh = static_cast<std::size_t>(node.mesh);
        Shown shown{mesh, weights_of(node, model.meshes[mesh], poses[i])};
        if (node.skin >= 0)
            add_skinned(placing, i, std::move(shown));
        else
            add_rigid(placing, i, shown);
    }
}

}  // namespace rcs
