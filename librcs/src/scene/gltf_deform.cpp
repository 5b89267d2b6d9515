#include "scene/gltf_deform.h"

#include <cmath>

#include "scene/gltf_accessor.h"

namespace rcs {
namespace {

constexpr GltfNoteKind kNoInfluences{"skins without joints and weights", "mesh", "kept in its rest pose"};
constexpr GltfNoteKind kBadWeights{"vertices whose skin weights sum to nothing", "mesh", "bound to their first joint"};

/// @return the accessor's index, -1 if there is none
int find(const std::map<std::string, int>& attributes, const std::string& name)
{
    const auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

void check_count(const GltfFile& file, const std::string& what, std::size_t count, std::size_t vertices)
{
    if (count == vertices) return;
    bad_file(file, what + " has " + std::to_string(count) + " elements, POSITION has " + std::to_string(vertices));
}

}  // namespace

Deformer::Deformer(const GltfFile& file, const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                   const Deformation& deformation, std::size_t vertices, const std::string& what,
                   const std::string& name)
    : file_(file), model_(model), primitive_(primitive), deformation_(deformation), what_(what)
{
    const std::size_t weights = deformation.weights.size();
    if (weights > 0 && weights != primitive.targets.size()) {
        bad_file(file, what + " has " + std::to_string(primitive.targets.size()) + " morph targets, but " +
                           std::to_string(weights) + " weights");
    }
    if (!deformation.joints.empty()) read_skin(vertices, name);
}

void Deformer::read_skin(std::size_t vertices, const std::string& name)
{
    for (int n = 0;; ++n) {
        const std::string joints = "JOINTS_" + std::to_string(n);
        const std::string weights = "WEIGHTS_" + std::to_string(n);
        const int joint_accessor = find(primitive_.attributes, joints);
        const int weight_accessor = find(primitive_.attributes, weights);
        if (joint_accessor < 0 || weight_accessor < 0) break;
        Influences& set = sets_.emplace_back();
        set.joints = read_vec4(file_, model_, joint_accessor, what_ + ", " + joints);
        set.weights = read_vec4(file_, model_, weight_accessor, what_ + ", " + weights);
        check_count(file_, what_ + ", " + joints, set.joints.size(), vertices);
        check_count(file_, what_ + ", " + weights, set.weights.size(), vertices);
    }
    if (sets_.empty()) file_.notes->add(kNoInfluences, name);

    std::size_t unbound = 0;
    for (std::size_t i = 0; i < vertices && !sets_.empty(); ++i) {
        float sum = 0.0f;
        for (const Influences& set : sets_) {
            for (int k = 0; k < 4; ++k) {
                sum += set.weights[i][k];
                const float joint = set.joints[i][k];
                if (joint >= 0.0f && joint < static_cast<float>(deformation_.joints.size())) continue;
                bad_file(file_, what_ + ": vertex " + std::to_string(i) + " names joint " + std::to_string(joint) +
                                    ", its skin has " + std::to_string(deformation_.joints.size()));
            }
        }
        const bool bound = std::isfinite(sum) && std::fabs(sum) > 1e-6f;
        if (!bound) ++unbound;
        for (Influences& set : sets_) {
            set.weights[i] = bound ? set.weights[i] / sum : glm::vec4(&set == sets_.data() ? 1.0f : 0.0f, 0, 0, 0);
        }
    }
    if (unbound > 0) file_.notes->add(kBadWeights, name, unbound);
}

glm::dmat4 Deformer::skin_matrix(std::size_t vertex) const
{
    glm::dmat4 sum(0.0);
    for (const Influences& set : sets_) {
        for (int k = 0; k < 4; ++k) {
            const double weight = set.weights[vertex][k];
            if (weight != 0.0) sum += weight * deformation_.joints[static_cast<std::size_t>(set.joints[vertex][k])];
        }
    }
    return sum;
}

void Deformer::morph(const char* attribute, std::vector<glm::vec3>& values) const
{
    for (std::size_t i = 0; i < deformation_.weights.size(); ++i) {
        const int accessor = find(primitive_.targets[i], attribute);
        if (accessor < 0 || deformation_.weights[i] == 0.0) continue;
        const std::string what = what_ + ", morph target " + std::to_string(i) + ", " + attribute;
        const std::vector<glm::vec3> offsets = read_vec3(file_, model_, accessor, what);
        check_count(file_, what, offsets.size(), values.size());
        const auto weight = static_cast<float>(deformation_.weights[i]);
        for (std::size_t v = 0; v < values.size(); ++v) values[v] += weight * offsets[v];
    }
}

void Deformer::skin_positions(std::vector<glm::vec3>& positions) const
{
    if (sets_.empty()) return;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        positions[i] = glm::vec3(glm::dvec3(skin_matrix(i) * glm::dvec4(positions[i], 1.0)));
    }
}

void Deformer::skin_normals(std::vector<glm::vec3>& normals) const
{
    if (sets_.empty()) return;
    for (std::size_t i = 0; i < normals.size(); ++i) {
        const glm::dmat3 m(skin_matrix(i));
        // The cofactors: the inverse's transpose times the determinant, defined for flat matrices too.
        const glm::dmat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
        const glm::dvec3 normal = cofactors * glm::dvec3(normals[i]);
        const double length = glm::length(normal);
        normals[i] = glm::vec3(length > 0.0 ? (glm::determinant(m) < 0.0 ? -normal : normal) / length : normal);
    }
}

void Deformer::skin_tangents(std::vector<glm::vec3>& tangents) const
{
    if (sets_.empty()) return;
    for (std::size_t i = 0; i < tangents.size(); ++i) {
        tangents[i] = glm::vec3(glm::dmat3(skin_matrix(i)) * glm::dvec3(tangents[i]));
    }
}

}  // namespace rcs
