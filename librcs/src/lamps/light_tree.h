#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lamps/lights.h"

namespace rcs {

/// A lamp to look at, and how many lamps it stands for: one over its chance to be drawn.
struct LampCandidate {
    std::uint32_t lamp;
    float multiplicity;
};

/// The triangles below a place in the tree, bounded together.
struct LightNode {
    glm::vec3 centre{0.0f};
    float radius = 0.0f;
    glm::vec3 axis{0.0f, 0.0f, 1.0f};
    float cos_cone = -1.0f, sin_cone = 0.0f;  ///< all normals lie within this angle of the axis; -1: anywhere
    float power = 0.0f;                       ///< luminance of radiance x area [W sr^-1]
    float least_distance2 = 0.0f;             ///< nearer a point counts as if it were so far away
    std::uint32_t child = 0;                  ///< the second one, the first follows its parent; 0: a leaf
    std::uint32_t triangle = 0;               ///< of a leaf
};

/// Emissive triangles in a binary tree of bounding spheres and cones of normals (Conty Estevez and Kulla 2018), for
/// scenes that have too many to look at each of them.
class LightTree {
public:
    LightTree() = default;
    explicit LightTree(const std::vector<EmissiveTriangle>& triangles);

    /// Candidates for the light of all triangles at a point: the tree is opened where it is brightest until there are
    /// as many parts as there is room, and each part sends one of its triangles. Sums of multiplicity x contribution
    /// are unbiased. @param offset  in [0, 1)   @param candidates  room for at least 1; triangles are numbered from 0
    std::size_t draw(glm::vec3 point, glm::vec3 normal, float offset, std::span<LampCandidate> candidates) const;

    /// Luminance of the irradiance that a triangle sends if nothing blocks it, roughly; 0 only if it sends none.
    float estimate(std::uint32_t triangle, glm::vec3 point, glm::vec3 normal) const;
    /// The same for all triangles together, from at most `parts` parts of the tree.
    float estimate(glm::vec3 point, glm::vec3 normal, std::size_t parts) const;

    /// Whether a ray may meet one of them: false only if it does not.
    bool may_meet(glm::vec3 origin, glm::vec3 unit_direction) const;

    static constexpr std::size_t kMostParts = 64;

private:
    struct Part {
        std::uint32_t node;
        float estimate;
    };

    std::uint32_t build(std::span<std::uint32_t> order, const std::vector<LightNode>& leaves);
    static float estimate(const LightNode& node, glm::vec3 point, glm::vec3 normal);
    std::size_t open(glm::vec3 point, glm::vec3 normal, std::span<Part> parts) const;

    std::vector<LightNode> nodes_;
    std::vector<std::uint32_t> leaf_of_;
};

}  // namespace rcs
