#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "rays/packet.h"
#include "rcs/scene.h"

namespace rcs {

/// Cells of a coarse grid over a scene that rays go through, or that things lie in. What rays find cannot have changed
/// where their ways do not meet those of what has changed: whatever lies in the way of one lies in one of its cells.
class Ways {
public:
    static constexpr int kCells = 16;  ///< along each axis; what lies outside of the box counts as one more

    /// @param box  that the grid lies over
    explicit Ways(const Bounds& box);
    /// @param direction  unit   @param length  [m], may be +inf
    void add_segment(glm::vec3 origin, glm::vec3 direction, float length);
    /// @param rays  traced   @param active  bit by lane
    void add_packet(std::uint32_t active, const RayPacket& rays);
    void add_box(const Bounds& box);
    void clear() { bits_.fill(0); }

    bool meet(std::span<const std::uint64_t> bits) const;
    std::span<const std::uint64_t> bits() const { return bits_; }

private:
    void set(glm::ivec3 cell);

    glm::dvec3 low_, cells_per_length_;
    std::array<std::uint64_t, kCells * kCells * kCells / 64 + 1> bits_{};  // the last one: outside
};

}  // namespace rcs
