#include "scene/gltf_nodes.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

namespace rcs {
namespace {

std::string name_of(const tinygltf::Model& model, std::size_t node)
{
    return element_name("node", node, model.nodes[node].name);
}

void check_length(const GltfFile& file, const tinygltf::Model& model, std::size_t node, const char* key,
                  const std::vector<double>& values, std::size_t expected)
{
    if (values.empty() || values.size() == expected) return;
    bad_file(file, name_of(model, node) + " has a " + key + " of " + std::to_string(values.size()) +
                       " numbers, expected " + std::to_string(expected));
}

glm::dvec3 vector_of(const std::vector<double>& values, glm::dvec3 missing)
{
    return values.empty() ? missing : glm::dvec3(values[0], values[1], values[2]);
}

glm::dmat4 local_matrix(const GltfFile& file, const tinygltf::Model& model, std::size_t index, const NodePose& pose)
{
    const tinygltf::Node& node = model.nodes[index];
    check_length(file, model, index, "matrix", node.matrix, 16);
    check_length(file, model, index, "translation", node.translation, 3);
    check_length(file, model, index, "rotation", node.rotation, 4);
    check_length(file, model, index, "scale", node.scale, 3);
    glm::dmat4 matrix(1.0);
    if (!node.matrix.empty()) {
        if (pose.moves()) bad_file(file, name_of(model, index) + " is moved by an animation, but has a matrix");
        for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
        return matrix;
    }
    matrix = glm::translate(matrix, pose.translation.value_or(vector_of(node.translation, glm::dvec3(0.0))));
    if (pose.rotation) {
        matrix *= glm::mat4_cast(*pose.rotation);
    } else if (!node.rotation.empty()) {
        const glm::dquat rotation(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        const double length = glm::length(rotation);
        if (!(length > 0.0)) bad_file(file, name_of(model, index) + " has a rotation of length 0");
        matrix *= glm::mat4_cast(rotation / length);
    }
    return glm::scale(matrix, pose.scale.value_or(vector_of(node.scale, glm::dvec3(1.0))));
}

constexpr int kNone = -1;

std::vector<int> parents_of(const GltfFile& file, const tinygltf::Model& model)
{
    std::vector<int> parents(model.nodes.size(), kNone);
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        for (const int child : model.nodes[i].children) {
            if (child < 0 || static_cast<std::size_t>(child) >= model.nodes.size()) {
                bad_file(file, name_of(model, i) + " has the child " + std::to_string(child) + ", the file has " +
                                   std::to_string(model.nodes.size()) + " nodes");
            }
            int& parent = parents[static_cast<std::size_t>(child)];
            if (parent != kNone) {
                bad_file(file, name_of(model, static_cast<std::size_t>(child)) + " is a child of two nodes, " +
                                   std::to_string(parent) + " and " + std::to_string(i));
            }
            parent = static_cast<int>(i);
        }
    }
    return parents;
}

/// Every node without a parent if the file has no scene.
std::vector<int> roots_of(const GltfFile& file, const tinygltf::Model& model, const std::vector<int>& parents)
{
    std::vector<int> roots;
    if (model.scenes.empty()) {
        for (std::size_t i = 0; i < parents.size(); ++i) {
            if (parents[i] == kNone) roots.push_back(static_cast<int>(i));
        }
        if (roots.empty() && !parents.empty()) bad_file(file, "its nodes form a cycle");
        return roots;
    }
    const int scene = std::max(0, model.defaultScene);
    if (static_cast<std::size_t>(scene) >= model.scenes.size()) {
        bad_file(file,
                 "its default scene is " + std::to_string(scene) + ", it has " + std::to_string(model.scenes.size()));
    }
    roots = model.scenes[static_cast<std::size_t>(scene)].nodes;
    for (const int root : roots) {
        if (root < 0 || static_cast<std::size_t>(root) >= parents.size()) {
            bad_file(file, "scene " + std::to_string(scene) + " names node " + std::to_string(root) +
                               ", the file has " + std::to_string(parents.size()));
        }
        const int parent = parents[static_cast<std::size_t>(root)];
        // A root with a parent would be there twice, or hang in a cycle.
        if (parent != kNone) {
            bad_file(file, "scene " + std::to_string(scene) + " names " +
                               name_of(model, static_cast<std::size_t>(root)) +
                               " as a root, but it is a child of node " + std::to_string(parent));
        }
    }
    return roots;
}

}  // namespace

std::vector<std::optional<glm::dmat4>> node_matrices(const GltfFile& file, const tinygltf::Model& model,
                                                     const std::vector<NodePose>& poses)
{
    // Each node has at most one parent and roots have none, so what is reached is a forest. The list of
    // open nodes takes the place of recursion: hierarchies may be deeper than the stack.
    std::vector<std::optional<glm::dmat4>> matrices(model.nodes.size());
    std::vector<int> open = roots_of(file, model, parents_of(file, model));
    for (const int root : open) {
        const auto index = static_cast<std::size_t>(root);
        matrices[index] = local_matrix(file, model, index, poses[index]);
    }
    while (!open.empty()) {
        const auto index = static_cast<std::size_t>(open.back());
        open.pop_back();
        check_matrix(file, model, index, *matrices[index]);
        for (const int child : model.nodes[index].children) {
            const auto child_index = static_cast<std::size_t>(child);
            matrices[child_index] = *matrices[index] * local_matrix(file, model, child_index, poses[child_index]);
            open.push_back(child);
        }
    }
    return matrices;
}

namespace {

bool hides(const tinygltf::Node& node)
{
    const auto found = node.extensions.find("KHR_node_visibility");
    if (found == node.extensions.end()) return false;
    const tinygltf::Value& value = found->second.Get("visible");
    return value.IsBool() && !value.Get<bool>();
}

}  // namespace

std::vector<bool> visible_nodes(const tinygltf::Model& model)
{
    // From what hides downwards, each node once: nodes outside of the scene may form a cycle.
    std::vector<bool> visible(model.nodes.size(), true);
    std::vector<std::size_t> open;
    const auto hide = [&](std::size_t node) {
        if (visible[node]) open.push_back(node);
        visible[node] = false;
    };
    for (std::size_t i = 0; i < visible.size(); ++i)
        if (hides(model.nodes[i])) hide(i);
    while (!open.empty()) {
        const std::size_t node = open.back();
        open.pop_back();
        for (const int child : model.nodes[node].children) hide(static_cast<std::size_t>(child));
    }
    return visible;
}

void check_entries(const GltfFile& file, const std::string& what, const glm::dmat4& matrix)
{
    // The scene keeps coordinates as floats; products of a few of them must stay in range.
    constexpr double kMaxEntry = 1e18;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) {
            const double value = matrix[column][row];
            if (!(std::fabs(value) <= kMaxEntry)) {
                bad_file(file, what + " has a matrix with the entry " + std::to_string(value) +
                                   ", expected numbers within 1e18 of zero");
            }
        }
    }
}

void check_matrix(const GltfFile& file, const tinygltf::Model& model, std::size_t node, const glm::dmat4& matrix)
{
    check_entries(file, name_of(model, node), matrix);
    for (int column = 0; column < 4; ++column) {
        if (std::fabs(matrix[column][3] - (column == 3 ? 1.0 : 0.0)) > 1e-6) {  // a float file's rounding
            bad_file(file, name_of(model, node) + " has a matrix whose last row is not 0 0 0 1");
        }
    }
}

bool is_singular(const glm::dmat4& matrix)
{
    // Columns shorter than this vanish in floats once they are squared; a volume below kFlattest of that
    // of a box with the same edges leaves fewer than half of a double's digits to the inverse.
    constexpr double kShortest = 1e-18;
    constexpr double kFlattest = 1e-8;
    double edges = 1.0;
    for (int column = 0; column < 3; ++column) {
        const double length = glm::length(glm::dvec3(matrix[column]));
        if (!(length > kShortest)) return true;
        edges *= length;
    }
    return std::fabs(glm::determinant(glm::dmat3(matrix))) <= kFlattest * edges;
}

}  // namespace rcs
