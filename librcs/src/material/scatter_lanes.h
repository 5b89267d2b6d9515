#pragma once

#include <cstddef>

#include <glm/glm.hpp>

namespace rcs {

/// Directions that light comes from, lane by lane; unit, or anything where nobody asks what comes of it.
struct DirectionLanes {
    static constexpr std::size_t kWidth = 16;

    float x[kWidth] = {}, y[kWidth] = {}, z[kWidth] = {};

    void set(std::size_t lane, glm::vec3 direction)
    {
        x[lane] = direction.x;
        y[lane] = direction.y;
        z[lane] = direction.z;
    }
    glm::vec3 operator[](std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
};

struct ColorLanes {
    float r[DirectionLanes::kWidth] = {}, g[DirectionLanes::kWidth] = {}, b[DirectionLanes::kWidth] = {};

    glm::vec3 operator[](std::size_t lane) const { return {r[lane], g[lane], b[lane]}; }
};

}  // namespace rcs
