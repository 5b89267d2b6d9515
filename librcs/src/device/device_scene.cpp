#include "device/device_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string>

#include "rays/hierarchy.h"
#include "rays/ray_scene_impl.h"
#include "rcs/error.h"
#include "shared/device_scene.h"

namespace rcs {
namespace {

constexpr std::uint32_t kMostTriangles = 4;  // in a leaf

std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }

/// What boxes of a node are told in.
struct Steps {
    float corner = 0.0f;
    int exponent = 1;  // of a step, biased

    float step() const { return std::bit_cast<float>(static_cast<std::uint32_t>(exponent) << 23); }
    float side(int steps) const { return gpu::rcs_box_side(corner, static_cast<float>(steps), step()); }
};

/// The finest steps that reach from one side to the other, none smaller than a rounding of what they are added to.
Steps steps_between(float low, float high)
{
    constexpr int kBias = 127, kMantissa = 23, kLeast = 1, kMost = 254;
    const auto exponent = [](float x) { return x > 0.0f ? std::ilogb(x) + kBias : 0; };
    const int of_rounding = exponent(std::max(std::abs(low), std::abs(high))) - kMantissa;
    Steps steps{low, std::clamp(std::max(exponent(high - low) - 8, of_rounding), kLeast, kMost)};
    while (steps.exponent < kMost && steps.side(255) < high) ++steps.exponent;
    return steps;
}

int steps_below(const Steps& steps, float side)
{
    int n = std::clamp(static_cast<int>((side - steps.corner) / steps.step()), 0, 255);
    while (n > 0 && steps.side(n) > side) --n;
    return n;
}

int steps_above(const Steps& steps, float side)
{
    int n = std::clamp(static_cast<int>(std::ceil((side - steps.corner) / steps.step())), 0, 255);
    while (n < 255 && steps.side(n) < side) ++n;
    return n;
}

/// @param refs  of the children
void add_node(const Hierarchy::Node& node, const std::array<std::uint32_t, Hierarchy::kWidth>& refs,
              std::vector<DeviceWords>& nodes)
{
    HierarchyBox all = node.child[0].box;
    for (std::uint32_t k = 1; k < node.children; ++k) {
        all.min = glm::min(all.min, node.child[k].box.min);
        all.max = glm::max(all.max, node.child[k].box.max);
    }
    DeviceWords head{bits(all.min.x), bits(all.min.y), bits(all.min.z), 0};
    std::array<std::array<std::uint32_t, 2>, 3> sides{};  // per axis: least, most; a byte a child
    for (glm::length_t axis = 0; axis < 3; ++axis) {
        const Steps steps = steps_between(all.min[axis], all.max[axis]);
        head[3] |= static_cast<std::uint32_t>(steps.exponent) << 8 * axis;
        auto& of_axis = sides[static_cast<std::size_t>(axis)];
        for (std::uint32_t k = 0; k < node.children; ++k) {
            const HierarchyBox& box = node.child[k].box;
            of_axis[0] |= static_cast<std::uint32_t>(steps_below(steps, box.min[axis])) << 8 * k;
            of_axis[1] |= static_cast<std::uint32_t>(steps_above(steps, box.max[axis])) << 8 * k;
        }
    }
    nodes.push_back(head);
    nodes.push_back(refs);
    nodes.push_back({sides[0][0], sides[1][0], sides[2][0], sides[0][1]});
    nodes.push_back({sides[1][1], sides[2][1], 0, 0});
}

/// @param leaf  (first, count) in the hierarchy's order: its word   @return the root's word
template <typename Leaf>
std::uint32_t add_hierarchy(const Hierarchy& hierarchy, std::vector<DeviceWords>& nodes, const Leaf& leaf)
{
    if (hierarchy.nodes.empty()) return RCS_DEVICE_NOTHING;
    const auto first = static_cast<std::uint32_t>(nodes.size() / RCS_DEVICE_NODE_WORDS);
    if (first + hierarchy.nodes.size() > RCS_DEVICE_FIRST_MASK)
        throw Error(ErrorCode::unsupported, "the scene has more than 2^27 nodes");
    for (const Hierarchy::Node& node : hierarchy.nodes) {
        std::array<std::uint32_t, Hierarchy::kWidth> refs;
        refs.fill(RCS_DEVICE_NOTHING);
        for (std::uint32_t k = 0; k < node.children; ++k)
            refs[k] =
                node.child[k].count == 0 ? first + node.child[k].first : leaf(node.child[k].first, node.child[k].count);
        add_node(node, refs, nodes);
    }
    return first;
}

/// Triangles on their way into the buffers.
struct Triangles {
    struct One {
        std::array<glm::vec3, 3> corner;
        std::uint32_t instance, primitive, flags;
    };
    std::vector<One> all;
    std::vector<HierarchyBox> boxes;

    void add(const Mesh& mesh, const std::vector<glm::vec3>& positions, std::uint32_t instance, bool see_through)
    {
        constexpr float kFarthest = 1.844e18f;  // of what Embree takes
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            const glm::uvec3 t = mesh.triangles[i];
            const std::array<glm::vec3, 3> c{positions[t.x], positions[t.y], positions[t.z]};
            const HierarchyBox box{glm::min(glm::min(c[0], c[1]), c[2]), glm::max(glm::max(c[0], c[1]), c[2])};
            const bool is_valid = std::all_of(c.begin(), c.end(), [](glm::vec3 p) {
                return std::abs(p.x) < kFarthest && std::abs(p.y) < kFarthest && std::abs(p.z) < kFarthest;
            });
            if (!is_valid) continue;
            all.push_back({c, instance, static_cast<std::uint32_t>(i), see_through ? RCS_DEVICE_SEE_THROUGH : 0u});
            boxes.push_back(box);
        }
    }

    /// @return the root's word
    std::uint32_t put(const RayScene& rays, DeviceScene& scene, int& depth) const
    {
        const Hierarchy hierarchy = build_hierarchy(rays, boxes, kMostTriangles);
        depth = hierarchy.depth;
        const auto first = static_cast<std::uint32_t>(scene.triangles.size() / RCS_DEVICE_TRIANGLE_WORDS);
        if (first + all.size() > RCS_DEVICE_FIRST_MASK)
            throw Error(ErrorCode::unsupported, "the scene has more than 2^27 triangles");
        for (const std::uint32_t i : hierarchy.order) {
            const One& t = all[i];
            const std::uint32_t tail[3] = {t.instance, t.primitive, t.flags};
            for (std::size_t k = 0; k < 3; ++k)
                scene.triangles.push_back({bits(t.corner[k].x), bits(t.corner[k].y), bits(t.corner[k].z), tail[k]});
        }
        return add_hierarchy(hierarchy, scene.nodes, [&](std::uint32_t at, std::uint32_t count) {
            return RCS_DEVICE_LEAF | (count - 1) << RCS_DEVICE_COUNT_SHIFT | (first + at);
        });
    }
};

/// Of a box in object space, in scene space, with room for roundings on both ways.
HierarchyBox moved(const HierarchyBox& box, const glm::mat4x3& scene_from_object)
{
    constexpr double kRoom = 0x1p-20;
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 p((corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                           (corner & 4) != 0 ? box.max.z : box.min.z);
        const glm::dvec3 q = glm::dmat4x3(scene_from_object) * glm::dvec4(p, 1.0);
        low = glm::min(low, q);
        high = glm::max(high, q);
    }
    const glm::dvec3 far = glm::max(glm::abs(low), glm::abs(high));
    const glm::dvec3 room(kRoom * std::max({far.x, far.y, far.z}));
    return {glm::vec3(low - room), glm::vec3(high + room)};
}

struct ObjectRoot {
    std::uint32_t word = RCS_DEVICE_NOTHING;
    HierarchyBox box;
    int depth = 0;
};

ObjectRoot add_object(const RayScene& rays, const RayInstance& instance, const std::vector<glm::vec3>& positions,
                      DeviceScene& scene)
{
    Triangles triangles;
    triangles.add(*instance.mesh, positions, 0, (instance.simulated & kSeeThrough) != 0u);
    ObjectRoot root;
    root.word = triangles.put(rays, scene, root.depth);
    if (triangles.boxes.empty()) return root;
    root.box = triangles.boxes[0];
    for (const HierarchyBox& b : triangles.boxes)
        root.box = {glm::min(root.box.min, b.min), glm::max(root.box.max, b.max)};
    return root;
}

void add_instance(std::uint32_t number, const RayInstance& instance, std::uint32_t root,
                  std::vector<DeviceWords>& instances)
{
    glm::dmat4 scene_from_object(1.0);
    for (glm::length_t c = 0; c < 4; ++c) scene_from_object[c] = glm::dvec4(instance.scene_from_object[c], c == 3);
    const glm::dmat4 object_from_scene = glm::inverse(scene_from_object);
    for (glm::length_t row = 0; row < 3; ++row) {
        DeviceWords words{};
        for (glm::length_t c = 0; c < 4; ++c)
            words[static_cast<std::size_t>(c)] = bits(static_cast<float>(object_from_scene[c][row]));
        instances.push_back(words);
    }
    instances.push_back({root, number, 0, 0});
}

}  // namespace

DeviceScene make_device_scene(const RayScene& rays)
{
    const RayScene::Impl& impl = rays.impl();
    DeviceScene scene;
    Triangles baked;
    std::map<const Mesh*, ObjectRoot> objects;
    std::vector<HierarchyBox> boxes;
    int depth_of_objects = 0;
    for (std::uint32_t i = 0; i < impl.instances.size(); ++i) {
        const RayInstance& instance = impl.instances[i];
        if (instance.mesh->triangles.empty()) continue;
        if (!instance.instanced) {
            baked.add(*instance.mesh, instance.positions, i, (instance.simulated & kSeeThrough) != 0u);
            continue;
        }
        auto object = objects.find(instance.mesh);
        if (object == objects.end()) {
            const auto mesh = static_cast<std::size_t>(instance.mesh - impl.scene->meshes.data());
            object =
                objects.emplace(instance.mesh, add_object(rays, instance, impl.object_positions[mesh], scene)).first;
        }
        const ObjectRoot& root = object->second;
        if (root.word == RCS_DEVICE_NOTHING) continue;
        depth_of_objects = std::max(depth_of_objects, root.depth);
        add_instance(i, instance, root.word, scene.instances);
        boxes.push_back(moved(root.box, instance.scene_from_object));
    }
    int depth = 0;
    scene.root = baked.put(rays, scene, depth);
    const Hierarchy over_instances = build_hierarchy(rays, boxes, 1);
    scene.root_of_instances = add_hierarchy(over_instances, scene.nodes, [&](std::uint32_t at, std::uint32_t) {
        return RCS_DEVICE_INSTANCE_LEAF | over_instances.order[at];
    });
    constexpr int kNeeded = static_cast<int>(Hierarchy::kWidth) - 1;  // of the stack, a level
    if (kNeeded * std::max(depth, over_instances.depth + depth_of_objects) + 4 > RCS_DEVICE_STACK)
        throw Error(ErrorCode::unsupported, "the scene's hierarchy is deeper than rays on a device can go");
    return scene;
}

}  // namespace rcs
