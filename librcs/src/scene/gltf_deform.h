#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "scene/gltf_file.h"
#include "scene/tinygltf.h"

namespace rcs {

/// How a node bends its mesh.
struct Deformation {
    std::vector<double> weights;     ///< of the morph targets; empty: none
    std::vector<glm::dmat4> joints;  ///< where each joint of the skin moves object space; empty: no skin

    bool rigid() const { return weights.empty() && joints.empty(); }
};

/// Bends the vertices of one primitive: morph targets first, then the skin (glTF 2.0, sections 3.7.2.2, 3.7.3).
class Deformer {
public:
    /// @param what  names the primitive in messages  @param name  of the mesh, for notes
    /// @throws Error bad_file
    Deformer(const GltfFile& file, const tinygltf::Model& model, const tinygltf::Primitive& primitive,
             const Deformation& deformation, std::size_t vertices, const std::string& what, const std::string& name);

    // Each takes one element per vertex. Morphing comes apart from skinning, since what is damaged in between
    // can be mended only before a skin turns it. Normals and tangents come out with any length.
    void morph(const char* attribute, std::vector<glm::vec3>& values) const;
    void skin_positions(std::vector<glm::vec3>& positions) const;
    void skin_normals(std::vector<glm::vec3>& normals) const;
    void skin_tangents(std::vector<glm::vec3>& tangents) const;

private:
    glm::dmat4 skin_matrix(std::size_t vertex) const;
    void read_skin(std::size_t vertices, const std::string& name);

    const GltfFile& file_;
    const tinygltf::Model& model_;
    const tinygltf::Primitive& primitive_;
    const Deformation& deformation_;
    std::string what_;
    struct Influences {
        std::vector<glm::vec4> joints;   ///< indices
        std::vector<glm::vec4> weights;  ///< sum to 1 over all sets
    };
    std::vector<Influences> sets_;  ///< JOINTS_n and WEIGHTS_n
};

}  // namespace rcs
