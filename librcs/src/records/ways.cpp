#include "records/ways.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs {
namespace {

constexpr double kLast = Ways::kCells - 1;
// Boxes are so much larger than they are [cells]: far more than a walk along a ray is off by rounding.
constexpr double kRim = 1e-3;
// Of the grid, around the box [cells]: what touches its sides does not reach out of the grid.
constexpr double kMargin = 0.01;

}  // namespace

Ways::Ways(const Bounds& box) : low_(0.0)
{
    glm::dvec3 size(0.0);
    if (box.min.x <= box.max.x) low_ = box.min, size = box.max - box.min;
    // A flat box has one layer of cells, far thicker than it is.
    const double longest = std::max({size.x, size.y, size.z});
    const double least = longest > 0.0 ? 1e-3 * longest : 1.0;
    cells_per_length_ = (kCells - 2.0 * kMargin) / glm::max(size, least);
    low_ -= kMargin / cells_per_length_;
}

void Ways::set(glm::ivec3 cell)
{
    const auto i = static_cast<std::size_t>((cell.z * kCells + cell.y) * kCells + cell.x);
    bits_[i / 64] |= std::uint64_t{1} << i % 64;
}

/// From wall to wall (Amanatides, Woo 1987, "A fast voxel traversal algorithm for ray tracing").
void Ways::add_segment(glm::vec3 origin, glm::vec3 direction, float length)
{
    const auto from = glm::vec3((glm::dvec3(origin) - low_) * cells_per_length_);
    const auto way = glm::vec3(glm::dvec3(direction) * cells_per_length_);
    constexpr float kSide = kCells;
    float begin = 0.0f, end = length;
    glm::vec3 next, step;  // the walls to come
    for (int axis = 0; axis < 3; ++axis) {
        const float inverse = 1.0f / way[axis];
        if (way[axis] == 0.0f) {
            if (!(from[axis] >= 0.0f && from[axis] <= kSide)) end = -1.0f;
            continue;
        }
        const float a = -from[axis] * inverse, b = (kSide - from[axis]) * inverse;
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    if (begin > 0.0f || end < length) bits_.back() = 1;
    if (!(begin <= end)) return;
    const glm::vec3 first = from + begin * way;
    glm::ivec3 cell;
    for (int axis = 0; axis < 3; ++axis) {
        cell[axis] = static_cast<int>(std::clamp(first[axis], 0.0f, static_cast<float>(kLast)));
        const float wall = static_cast<float>(cell[axis] + (way[axis] > 0.0f ? 1 : 0));
        next[axis] = way[axis] == 0.0f ? std::numeric_limits<float>::infinity() : (wall - from[axis]) / way[axis];
        step[axis] = std::abs(1.0f / way[axis]);
    }
    while (true) {
        set(cell);
        const int axis = next.x < next.y ? (next.x < next.z ? 0 : 2) : (next.y < next.z ? 1 : 2);
        if (!(next[axis] <= end)) return;
        cell[axis] += way[axis] > 0.0f ? 1 : -1;
        if (cell[axis] < 0 || cell[axis] >= kCells) return;
        next[axis] += step[axis];
    }
}

void Ways::add_packet(std::uint32_t active, const RayPacket& rays)
{
    for (int i = 0; i < RayPacket::kWidth; ++i)
        if ((active >> i & 1u) != 0u) add_segment(ray_origin(rays, i), ray_direction(rays, i), rays.t_max[i]);
}

void Ways::add_box(const Bounds& box)
{
    if (!(box.min.x <= box.max.x)) return;
    const glm::dvec3 low = (box.min - low_) * cells_per_length_ - kRim,
                     high = (box.max - low_) * cells_per_length_ + kRim;
    if (std::min({low.x, low.y, low.z}) < 0.0 || std::max({high.x, high.y, high.z}) > kCells) bits_.back() = 1;
    const glm::ivec3 first(glm::clamp(glm::floor(low), 0.0, kLast)), last(glm::clamp(glm::floor(high), 0.0, kLast));
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) set({x, y, z});
}

bool Ways::meet(std::span<const std::uint64_t> bits) const
{
    for (std::size_t i = 0; i < bits_.size(); ++i)
        if ((bits_[i] & bits[i]) != 0) return true;
    return false;
}

}  // namespace rcs
