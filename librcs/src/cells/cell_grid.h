#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <glm/glm.hpp>

#include "rcs/camera.h"
#include "rcs/scene.h"

namespace rcs {

/// How surfaces are cut into cells: cubes of a grid times sectors of the surface's normal. Level l has cubes of
/// edge 2^l times the finest. A surface's own level follows from its distance to the camera, so that a cell looks
/// about equally large everywhere.
struct CellGrid {
    static constexpr int kLevels = 16;

    glm::vec3 corner{0.0f};                              ///< all of the scene lies above it, scene space [m]
    glm::vec3 eye{0.0f};                                 ///< scene space [m]
    float finest = 1.0f;                                 ///< edge at level 0 [m]
    float edge_at_eye = 0.0f, edge_per_distance = 0.0f;  ///< wanted edge of a cell: linear in the distance

    /// Edge of a cube [m].
    float edge(int level) const { return std::ldexp(finest, level); }

    /// The level of a surface here, in [0, kCoarsestLeaf].
    int level(glm::vec3 position) const
    {
        const float wanted = (edge_at_eye + edge_per_distance * glm::distance(position, eye)) / finest;
        // The exponent of a float of at least 1 is its logarithm to base 2, rounded down.
        const int exponent = static_cast<int>(std::bit_cast<std::uint32_t>(std::max(wanted, 1.0f)) >> 23) - 127;
        return std::min(exponent, kCoarsestLeaf);
    }

    /// The cell of a surface at this level: 54 sectors of normals, 3 x 3 on each face of a cube around the middle
    /// of a face (flat walls lie in the middle of one).
    std::uint64_t leaf(glm::vec3 position, glm::vec3 normal, int level) const
    {
        const int axis = major_axis(normal);
        const float inverse = 1.0f / std::abs(normal[axis]);
        const std::uint64_t u = third(normal[(axis + 1) % 3] * inverse), v = third(normal[(axis + 2) % 3] * inverse);
        return key(position, level, face(normal, axis) * 9 + u * 3 + v);
    }

    /// The next coarser cell around a cell, one of those that average over leaves: 6 sectors of normals.
    /// @param cell  of a level below the last
    static std::uint64_t parent(std::uint64_t cell)
    {
        const std::uint64_t sector = cell >> 54 & 63u;
        const auto halved = [&](int shift) { return (cell >> shift & kCubes) >> 1 << shift; };
        return halved(0) | halved(18) | halved(36) | (sector < 54 ? 54 + sector / 9 : sector) << 54 |
               (level_of(cell) + 1) << 60;
    }
    static std::uint64_t level_of(std::uint64_t cell) { return cell >> 60; }

private:
    static constexpr std::uint64_t kCubes = 0x3ffff;  // 18 bits for each coordinate of a cube
    static constexpr int kCoarsestLeaf = 11;          // an edge of 1/64 of the scene's diagonal

    static int major_axis(glm::vec3 n)
    {
        const glm::vec3 a = glm::abs(n);
        return a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    }
    static std::uint64_t face(glm::vec3 n, int axis) { return static_cast<std::uint64_t>(2 * axis + (n[axis] < 0.0f)); }
    static std::uint64_t third(float x) { return x < -0.4f ? 0u : x > 0.4f ? 2u : 1u; }

    std::uint64_t key(glm::vec3 position, int level, std::uint64_t sector) const
    {
        const glm::vec3 p = glm::clamp((position - corner) / finest, 0.0f, static_cast<float>(kCubes));
        const auto cube = [&](float x) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x) >> level); };
        return cube(p.x) | cube(p.y) << 18 | cube(p.z) << 36 | sector << 54 | static_cast<std::uint64_t>(level) << 60;
    }
};

/// The cell of a surface, as fine as its place asks for.
inline std::uint64_t leaf_at(const CellGrid& grid, glm::vec3 position, glm::vec3 normal)
{
    return grid.leaf(position, normal, grid.level(position));
}

/// @param bounds  of the scene, not empty
CellGrid make_cell_grid(const Bounds& bounds, const View& view);

}  // namespace rcs
