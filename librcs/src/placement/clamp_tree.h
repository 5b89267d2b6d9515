#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

namespace rcs {

/// Places that lie near each other, side by side, and the least that was found at each.
struct ClampedPlaces {
    static constexpr std::size_t kLanes = 16;

    float position[3][kLanes];  ///< those beyond the last place are that place again
    float least[kLanes];        ///< in: more than this is not wanted
    glm::vec3 low, high;        ///< box around them
};

/// A tree over points with a distance of their own R_j, for the least R_j + |x_i - x_j| over all j at places x_i.
class ClampTree {
public:
    struct Point {
        glm::vec3 position;
        float distance;
    };
    ClampTree() = default;
    /// @param points  in an order in which those that follow each other lie near each other, as along a Z curve
    /// @param beyond  1; or 0 for the least max(R_j, |x_i - x_j|)
    ClampTree(std::vector<Point> points, float beyond);

    /// Lowers what is the least at each of the places. The same bits in whatever order trees are asked.
    void lower(ClampedPlaces& places) const;

private:
    struct Node {
        glm::vec3 low, high;
        float least;               // R_j below it
        std::uint32_t begin, end;  // of points_
        std::uint32_t right;       // the left child follows its parent; 0 marks a leaf
    };
    std::uint32_t build(std::size_t begin, std::size_t end);

    std::vector<Point> points_;
    std::vector<Node> nodes_;
    float beyond_ = 1.0f;
};

}  // namespace rcs
