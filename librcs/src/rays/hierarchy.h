#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/ray_scene.h"

namespace rcs {

/// What bounds a thing, or some.
struct HierarchyBox {
    glm::vec3 min{0.0f}, max{0.0f};
};

/// A tree of boxes, up to four children a node: what others than Embree trace rays through.
struct Hierarchy {
    static constexpr std::uint32_t kWidth = 4;

    struct Child {
        HierarchyBox box;
        std::uint32_t first = 0;  ///< index of a node, or where a leaf begins in `order`
        std::uint32_t count = 0;  ///< of things in a leaf; 0: it is a node
    };
    struct Node {
        std::array<Child, kWidth> child;
        std::uint32_t children = 0;  ///< so many of them are there
    };
    std::vector<Node> nodes;           ///< 0 is the root, parents before children; empty: there is nothing
    std::vector<std::uint32_t> order;  ///< the things by number, as leaves have them
    int depth = 0;                     ///< nodes on the longest way down
};

/// Built by Embree's builder. The same boxes make the same tree, whatever the number of threads.
/// @param rays  has the Embree that builds   @param boxes  finite ones
/// @param most  of things in a leaf, in [1, 8]   @throws Error internal, out_of_memory: what Embree reported
Hierarchy build_hierarchy(const RayScene& rays, std::span<const HierarchyBox> boxes, std::uint32_t most);

}  // namespace rcs
