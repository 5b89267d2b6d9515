#include "placement/clamp_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr std::size_t kLeaf = 8;
constexpr std::size_t kLanes = ClampedPlaces::kLanes;

/// @return what is the greatest at any of the places after that
RCS_MULTIVERSION
float lower_by(std::span<const ClampTree::Point> points, float beyond, ClampedPlaces& places)
{
    float least[kLanes];
    std::copy(places.least, places.least + kLanes, least);
    for (const ClampTree::Point& point : points) {
        const float x = point.position.x, y = point.position.y, z = point.position.z;
        const float own = point.distance, added = beyond * own;
        RCS_WHOLE_LOOP
        for (std::size_t l = 0; l < kLanes; ++l) {
            const float dx = places.position[0][l] - x, dy = places.position[1][l] - y, dz = places.position[2][l] - z;
            const float there = added + std::sqrt(dx * dx + dy * dy + dz * dz);
            const float value = there < own ? own : there;
            least[l] = value < least[l] ? value : least[l];
        }
    }
    std::copy(least, least + kLanes, places.least);
    return *std::max_element(least, least + kLanes);
}

/// Leaves out points that lower nothing by as much as another of their group, next to each other in the order, does:
/// R_j + |x - x_j| is nowhere less than R_k + |x - x_k| if R_j is no less than R_k + |x_j - x_k|.
void leave_out_needless(std::vector<ClampTree::Point>& points)
{
    constexpr std::size_t kGroup = 8 * kLanes;
    // Left out are those that another undercuts by more than sums are rounded by.
    constexpr float kUndercut = 0.9999f;
    std::vector<float> least(points.size());
    ClampedPlaces places;
    for (std::size_t first = 0; first < points.size(); first += kLanes) {
        const std::size_t group = first / kGroup * kGroup, count = std::min(kLanes, points.size() - first);
        for (std::size_t l = 0; l < kLanes; ++l) {
            const ClampTree::Point& own = points[first + std::min(l, count - 1)];
            for (int axis = 0; axis < 3; ++axis) places.position[axis][l] = own.position[axis];
            places.least[l] = own.distance;
        }
        lower_by(std::span(points).subspan(group, std::min(kGroup, points.size() - group)), 1.0f, places);
        std::copy_n(places.least, count, &least[first]);
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!(least[i] < kUndercut * points[i].distance)) points[kept++] = points[i];
    points.resize(kept);
}

/// Squared distance between two boxes.
float distance2(glm::vec3 low, glm::vec3 high, const ClampedPlaces& places)
{
    const glm::vec3 d = glm::max(glm::max(low - places.high, places.low - high), glm::vec3(0.0f));
    return glm::dot(d, d);
}

}  // namespace

ClampTree::ClampTree(std::vector<Point> points, float beyond) : points_(std::move(points)), beyond_(beyond)
{
    if (beyond_ == 1.0f) leave_out_needless(points_);
    if (!points_.empty()) build(0, points_.size());
}

std::uint32_t ClampTree::build(std::size_t begin, std::size_t end)
{
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const auto id = static_cast<std::uint32_t>(nodes_.size());
    Node node{glm::vec3(kInfinity),
              glm::vec3(-kInfinity),
              kInfinity,
              static_cast<std::uint32_t>(begin),
              static_cast<std::uint32_t>(end),
              0};
    nodes_.push_back(node);
    const auto take_in = [&](glm::vec3 low, glm::vec3 high, float least) {
        node.low = glm::min(node.low, low);
        node.high = glm::max(node.high, high);
        node.least = std::min(node.least, least);
    };
    if (end - begin <= kLeaf) {
        for (std::size_t k = begin; k < end; ++k)
            take_in(points_[k].position, points_[k].position, points_[k].distance);
    } else {
        const std::size_t middle = (begin + end) / 2;
        build(begin, middle);
        node.right = build(middle, end);
        for (const std::uint32_t child : {id + 1, node.right})
            take_in(nodes_[child].low, nodes_[child].high, nodes_[child].least);
    }
    nodes_[id] = node;
    return id;
}

void ClampTree::lower(ClampedPlaces& places) const
{
    if (nodes_.empty()) return;
    // Rounded up, so that no point is passed by that lowers anything by a bit.
    constexpr float kBarelyMore = 1.00001f;
    float greatest = *std::max_element(places.least, places.least + kLanes);
    const auto may_lower = [&](const Node& node, float to_node) {
        const float room = kBarelyMore * greatest - beyond_ * node.least;
        return node.least < greatest && room > 0.0f && to_node <= room * room;
    };
    struct Waiting {
        std::uint32_t node;
        float distance2;
    };
    std::array<Waiting, 64> stack;  // halves: 2^32 points are 32 deep
    std::size_t waiting = 0;
    stack[waiting++] = {0, distance2(nodes_[0].low, nodes_[0].high, places)};
    while (waiting > 0) {
        const Waiting next = stack[--waiting];
        const Node& node = nodes_[next.node];
        if (!may_lower(node, next.distance2)) continue;
        if (node.right == 0) {
            greatest = lower_by(std::span(points_).subspan(node.begin, node.end - node.begin), beyond_, places);
            continue;
        }
        Waiting near{next.node + 1, 0.0f}, far{node.right, 0.0f};
        for (Waiting* child : {&near, &far})
            child->distance2 = distance2(nodes_[child->node].low, nodes_[child->node].high, places);
        if (far.distance2 < near.distance2) std::swap(near, far);
        stack[waiting++] = far;
        stack[waiting++] = near;
    }
}

}  // namespace rcs
