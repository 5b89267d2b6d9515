#include "lamps/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "util/color.h"

namespace rcs {
namespace {

/// The sphere around two.
void enclose(glm::vec3 c1, float r1, glm::vec3 c2, float r2, glm::vec3& centre, float& radius)
{
    const float d = glm::distance(c1, c2);
    if (d + r2 <= r1 || d + r1 <= r2) {
        centre = d + r2 <= r1 ? c1 : c2;
        radius = std::max(r1, r2);
        return;
    }
    radius = 0.5f * (d + r1 + r2);
    centre = c1 + (c2 - c1) * ((radius - r1) / d);
    radius *= 1.0f + 0x1p-20f;
}

/// Where the leaves' centres lie along the longest side of their box: in one of 16 bins.
class Bins {
public:
    static constexpr int kCount = 16;

    Bins(std::span<const std::uint32_t> order, const std::vector<LightNode>& leaves)
    {
        glm::vec3 low(std::numeric_limits<float>::infinity()), high(-low);
        for (const std::uint32_t i : order) {
            low = glm::min(low, leaves[i].centre);
            high = glm::max(high, leaves[i].centre);
        }
        const glm::vec3 size = high - low;
        axis_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        low_ = low[axis_];
        size_ = size[axis_];
    }

    int of(const LightNode& leaf) const
    {
        const float at = size_ > 0.0f ? (leaf.centre[axis_] - low_) / size_ : 0.0f;
        return std::min(static_cast<int>(at * kCount), kCount - 1);
    }

private:
    int axis_;
    float low_, size_;
};

/// Leaves of neighbouring bins together.
struct Half {
    glm::vec3 low{std::numeric_limits<float>::infinity()}, high{-std::numeric_limits<float>::infinity()};
    double power = 0.0;
    std::size_t count = 0;

    void add(const Half& b)
    {
        low = glm::min(low, b.low);
        high = glm::max(high, b.high);
        power += b.power;
        count += b.count;
    }
    double cost() const
    {
        if (count == 0) return 0.0;
        const glm::dvec3 d(high - low);
        return power * glm::dot(d, d);
    }
};

/// The bin before which power x size^2 of both parts is least; 0: no place parts them.
int best_split(const Bins& bins, std::span<const std::uint32_t> order, const std::vector<LightNode>& leaves)
{
    constexpr int kCount = Bins::kCount;
    std::array<Half, kCount> parts;
    for (const std::uint32_t i : order) {
        const LightNode& leaf = leaves[i];
        parts[static_cast<std::size_t>(bins.of(leaf))].add(
            {leaf.centre - leaf.radius, leaf.centre + leaf.radius, static_cast<double>(leaf.power), 1});
    }
    int best = 0;
    double best_cost = std::numeric_limits<double>::infinity();
    for (int split = 1; split < kCount; ++split) {
        Half left, right;
        for (int b = 0; b < kCount; ++b) (b < split ? left : right).add(parts[static_cast<std::size_t>(b)]);
        if (left.count == 0 || right.count == 0) continue;
        if (left.cost() + right.cost() < best_cost) {
            best_cost = left.cost() + right.cost();
            best = split;
        }
    }
    return best;
}

/// A node around two; its child is not set. The cone is simple and loose, its axis between theirs.
LightNode parent_of(const LightNode& a, const LightNode& b)
{
    LightNode node;
    enclose(a.centre, a.radius, b.centre, b.radius, node.centre, node.radius);
    node.power = a.power + b.power;
    node.least_distance2 = 0.25f * node.radius * node.radius;
    const glm::vec3 sum = a.axis + b.axis;
    if (a.cos_cone > -1.0f && b.cos_cone > -1.0f && glm::dot(sum, sum) > 1e-6f) {
        node.axis = glm::normalize(sum);
        const auto reach = [&](const LightNode& n) {
            return std::acos(std::clamp(glm::dot(node.axis, n.axis), -1.0f, 1.0f)) +
                   std::acos(std::clamp(n.cos_cone, -1.0f, 1.0f));
        };
        const float angle = std::max(reach(a), reach(b)) + 1e-3f;
        node.cos_cone = angle < 3.1f ? std::cos(angle) : -1.0f;
        node.sin_cone = angle < 3.1f ? std::sin(angle) : 0.0f;
    }
    return node;
}

}  // namespace

LightTree::LightTree(const std::vector<EmissiveTriangle>& triangles)
{
    if (triangles.empty()) return;
    std::vector<LightNode> leaves;
    std::vector<std::uint32_t> order;
    for (const EmissiveTriangle& t : triangles) {
        LightNode leaf;
        leaf.centre = (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f;
        for (const glm::vec3& corner : t.corner)
            leaf.radius = std::max(leaf.radius, glm::distance(leaf.centre, corner));
        leaf.axis = t.normal;
        leaf.cos_cone = t.double_sided ? -1.0f : 1.0f;
        leaf.power = luminance(t.radiance) * t.area;
        leaf.least_distance2 = 0.25f * t.area;
        leaf.triangle = static_cast<std::uint32_t>(order.size());
        order.push_back(leaf.triangle);
        leaves.push_back(leaf);
    }
    nodes_.reserve(2 * leaves.size());
    leaf_of_.resize(leaves.size());
    build(order, leaves);
}

/// Halves in two at the place of the best split, or in the middle if none parts them.
std::uint32_t LightTree::build(std::span<std::uint32_t> order, const std::vector<LightNode>& leaves)
{
    const std::uint32_t index = static_cast<std::uint32_t>(nodes_.size());
    if (order.size() == 1) {
        nodes_.push_back(leaves[order[0]]);
        leaf_of_[order[0]] = index;
        return index;
    }
    nodes_.emplace_back();
    const Bins bins(order, leaves);
    const int split = best_split(bins, order, leaves);
    auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    if (split > 0)
        middle =
            std::partition(order.begin(), order.end(), [&](std::uint32_t i) { return bins.of(leaves[i]) < split; });
    const std::size_t left = static_cast<std::size_t>(middle - order.begin());
    const std::uint32_t first = build(order.subspan(0, left), leaves);
    const std::uint32_t second = build(order.subspan(left), leaves);
    nodes_[index] = parent_of(nodes_[first], nodes_[second]);
    nodes_[index].child = second;
    return index;
}

/// Cosines are those of the most favourable point and normal inside the bounds: never 0 where light can arrive.
float LightTree::estimate(const LightNode& node, glm::vec3 point, glm::vec3 normal)
{
    const glm::vec3 d = node.centre - point;
    const float d2 = glm::dot(d, d) + 1e-30f;
    const float inverse_d = 1.0f / std::sqrt(d2);
    const float seen = (node.radius + glm::dot(d, normal)) * inverse_d;
    if (!(seen > 0.0f)) return 0.0f;
    float facing = 1.0f;
    const float sin_size = node.radius * inverse_d;
    if (node.cos_cone > -1.0f && sin_size < 1.0f) {
        // Angle between the axis and the way to the point, less that of the cone, less that of the sphere.
        const float cos_size = std::sqrt(1.0f - sin_size * sin_size);
        const float cos_axis = std::clamp(-glm::dot(d, node.axis) * inverse_d, -1.0f, 1.0f);
        const float sin_axis = std::sqrt(1.0f - cos_axis * cos_axis);
        if (cos_axis < node.cos_cone) {
            const float c = cos_axis * node.cos_cone + sin_axis * node.sin_cone;
            const float s = sin_axis * node.cos_cone - cos_axis * node.sin_cone;
            facing = c >= cos_size ? 1.0f : c * cos_size + s * sin_size;
            if (!(facing > 0.0f)) return 0.0f;
        }
    }
    return node.power * facing * std::min(seen, 1.0f) / std::max(d2, node.least_distance2);
}

float LightTree::estimate(std::uint32_t triangle, glm::vec3 point, glm::vec3 normal) const
{
    return estimate(nodes_[leaf_of_[triangle]], point, normal);
}

bool LightTree::may_meet(glm::vec3 origin, glm::vec3 direction) const
{
    // A few levels are enough to find out for most rays.
    constexpr int kDepth = 8;
    const auto meets = [&](const auto& self, std::uint32_t index, int depth) -> bool {
        const LightNode& node = nodes_[index];
        const glm::vec3 d = node.centre - origin;
        const float along = glm::dot(d, direction);
        const float radius2 = 1.0001f * node.radius * node.radius, d2 = glm::dot(d, d);
        if (d2 > radius2 && (along < 0.0f || d2 - along * along > radius2 + 1e-5f * d2)) return false;
        if (node.child == 0 || depth == kDepth) return true;
        return self(self, index + 1, depth + 1) || self(self, node.child, depth + 1);
    };
    return !nodes_.empty() && meets(meets, 0, 0);
}

/// Parts are kept as a heap with the brightest inner node on top; leaves, which cannot be opened, behind it.
std::size_t LightTree::open(glm::vec3 point, glm::vec3 normal, std::span<Part> parts) const
{
    const auto dimmer = [](const Part& a, const Part& b) { return a.estimate < b.estimate; };
    std::size_t inner = 0, end = parts.size();  // leaves fill the array from its end
    const auto add = [&](std::uint32_t node) {
        const float e = estimate(nodes_[node], point, normal);
        if (!(e > 0.0f)) return;
        if (nodes_[node].child == 0) {
            parts[--end] = {node, e};
        } else {
            parts[inner++] = {node, e};
            std::push_heap(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(inner), dimmer);
        }
    };
    if (!nodes_.empty()) add(0);
    while (inner > 0 && inner < end) {
        std::pop_heap(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(inner), dimmer);
        const std::uint32_t node = parts[--inner].node;
        add(node + 1);
        add(nodes_[node].child);
    }
    return static_cast<std::size_t>(std::copy(parts.begin() + static_cast<std::ptrdiff_t>(end), parts.end(),
                                              parts.begin() + static_cast<std::ptrdiff_t>(inner)) -
                                    parts.begin());
}

float LightTree::estimate(glm::vec3 point, glm::vec3 normal, std::size_t parts) const
{
    std::array<Part, kMostParts> opened;
    const std::size_t count = open(point, normal, std::span(opened).first(std::min(parts, kMostParts)));
    float sum = 0.0f;
    for (std::size_t i = 0; i < count; ++i) sum += opened[i].estimate;
    return sum;
}

std::size_t LightTree::draw(glm::vec3 point, glm::vec3 normal, float offset, std::span<LampCandidate> candidates) const
{
    std::array<Part, kMostParts> parts;
    const std::size_t count = open(point, normal, std::span(parts).first(std::min(candidates.size(), kMostParts)));
    std::size_t drawn = 0;
    for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t node = parts[i].node;
        // Every part has a number of its own, spread by the golden ratio.
        double u = static_cast<double>(offset) + 0.6180339887498949 * static_cast<double>(i);
        u -= std::floor(u);
        double chance = 1.0;
        while (nodes_[node].child != 0) {
            const double a = static_cast<double>(estimate(nodes_[node + 1], point, normal));
            const double b = static_cast<double>(estimate(nodes_[nodes_[node].child], point, normal));
            if (!(a + b > 0.0)) break;
            const double share = a / (a + b);
            if (u < share) {
                node = node + 1;
                u /= share;
                chance *= share;
            } else {
                node = nodes_[node].child;
                u = (u - share) / (1.0 - share);
                chance *= 1.0 - share;
            }
        }
        if (nodes_[node].child == 0) candidates[drawn++] = {nodes_[node].triangle, static_cast<float>(1.0 / chance)};
    }
    return drawn;
}

}  // namespace rcs
