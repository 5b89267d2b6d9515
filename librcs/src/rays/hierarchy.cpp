#include "rays/hierarchy.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>

#include "rays/embree.h"
#include "rays/ray_scene_impl.h"
#include "rcs/error.h"

namespace rcs {
namespace {

/// As Embree asks for them: in memory of its own, from any of its threads.
struct BuiltNode {
    std::uint32_t leaf_count = 0;  // 0: a node
    std::uint32_t children = 0;
    union {
        BuiltNode* child[Hierarchy::kWidth];
        std::uint32_t thing[2 * Hierarchy::kWidth];
    };
    HierarchyBox box[Hierarchy::kWidth];
};
constexpr std::uint32_t kMostInLeaf = 2 * Hierarchy::kWidth;

BuiltNode* new_node(RTCThreadLocalAllocator allocator)
{
    return new (rtcThreadLocalAlloc(allocator, sizeof(BuiltNode), 16)) BuiltNode{};
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned count, void*)
{
    BuiltNode* node = new_node(allocator);
    node->children = count;
    return node;
}

void set_children(void* node, void** children, unsigned count, void*)
{
    for (unsigned i = 0; i < count; ++i) static_cast<BuiltNode*>(node)->child[i] = static_cast<BuiltNode*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*)
{
    for (unsigned i = 0; i < count; ++i) {
        const RTCBounds& b = *bounds[i];
        static_cast<BuiltNode*>(node)->box[i] = {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
    }
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* things, std::size_t count, void*)
{
    BuiltNode* node = new_node(allocator);
    node->leaf_count = static_cast<std::uint32_t>(count);
    for (std::size_t i = 0; i < count; ++i) node->thing[i] = things[i].primID;
    std::sort(node->thing, node->thing + count);  // threads part them in any order
    return node;
}

std::vector<RTCBuildPrimitive> things_of(std::span<const HierarchyBox> boxes)
{
    std::vector<RTCBuildPrimitive> things(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const HierarchyBox& b = boxes[i];
        things[i] = {b.min.x, b.min.y, b.min.z, 0, b.max.x, b.max.y, b.max.z, static_cast<std::uint32_t>(i)};
    }
    return things;
}

struct Flattener {
    Hierarchy result;

    Hierarchy::Child leaf(const BuiltNode& from, const HierarchyBox& box)
    {
        const Hierarchy::Child child{box, static_cast<std::uint32_t>(result.order.size()), from.leaf_count};
        result.order.insert(result.order.end(), from.thing, from.thing + from.leaf_count);
        return child;
    }

    std::uint32_t node(const BuiltNode& from, int depth)
    {
        const std::size_t here = result.nodes.size();
        result.nodes.emplace_back();
        result.depth = std::max(result.depth, depth);
        for (std::uint32_t i = 0; i < from.children; ++i) {
            const BuiltNode& to = *from.child[i];
            const Hierarchy::Child child =
                to.leaf_count > 0 ? leaf(to, from.box[i]) : Hierarchy::Child{from.box[i], node(to, depth + 1), 0};
            result.nodes[here].child[i] = child;
        }
        result.nodes[here].children = from.children;
        return static_cast<std::uint32_t>(here);
    }
};

}  // namespace

Hierarchy build_hierarchy(const RayScene& rays, std::span<const HierarchyBox> boxes, std::uint32_t most)
{
    if (boxes.empty()) return {};
    RTCDevice device = rays.impl().embree->device;
    const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> tree(rtcNewBVH(device), &rtcReleaseBVH);
    std::vector<RTCBuildPrimitive> things = things_of(boxes);
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.maxBranchingFactor = Hierarchy::kWidth;
    // From eight levels above that on it halves what is left.
    arguments.maxDepth = 20;
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = std::min(most, kMostInLeaf);
    arguments.bvh = tree.get();
    arguments.primitives = things.data();
    arguments.primitiveCount = arguments.primitiveArrayCapacity = things.size();
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    const auto* root = static_cast<const BuiltNode*>(rtcBuildBVH(&arguments));
    throw_on_error(device, "building a hierarchy");
    if (!root) throw Error(ErrorCode::internal, "Embree built no hierarchy");
    Flattener flat;
    if (root->leaf_count == 0) {
        flat.node(*root, 1);
        return std::move(flat.result);
    }
    HierarchyBox box = boxes[0];
    for (const HierarchyBox& b : boxes) box = {glm::min(box.min, b.min), glm::max(box.max, b.max)};
    Hierarchy::Node only;
    only.child[only.children++] = flat.leaf(*root, box);
    flat.result.nodes.push_back(only);
    flat.result.depth = 1;
    return std::move(flat.result);
}

}  // namespace rcs
