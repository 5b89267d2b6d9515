#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lamps/gathered_lamps.h"
#include "lit_points/importance.h"
#include "rays/surface.h"
#include "rcs/ray_scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Part of one side of a triangle: where anything nearby is seen, a few cells of the grid long at most.
struct SurfacePiece {
    static constexpr std::size_t kProbes = 4;

    std::uint32_t instance, primitive;
    glm::vec2 corner[3];       ///< barycentric weights of the triangle's second and third corner
    glm::vec3 normal;          ///< scene space, unit, on this side
    glm::vec3 probe[kProbes];  ///< places on it
    float area;                ///< that it stands for [m^2], more than its own where triangles were left out
};

/// Whether light from an instance's surfaces may be gathered at points on them: not from what lets light through.
bool can_be_lit(const RayScene& rays, std::uint32_t instance);

/// Which surfaces are cut, and how finely.
struct SurfaceCut {
    const RayScene& rays;
    const GatheredLamps* lamps;    ///< may be null: then it is what reflects
    const Importance& importance;  ///< pieces are about as large as its cells
    double part = 1.0;             ///< (0, 1], of the pieces that it takes for that
};
/// All sides of surfaces that can be lit and reflect; or else those of lamps that emit. Where there are more than a
/// million triangles, some stand for the others, at random.
std::vector<SurfacePiece> surface_pieces(const SurfaceCut& of, std::uint64_t seed, ThreadPool& pool);

/// A point on a piece, uniformly. @param u  in [0, 1)^2
struct PointOnPiece {
    Hit hit;
    SurfacePoint point;
    float uv_per_length;
};
PointOnPiece point_on(const RayScene& rays, const SurfacePiece& piece, glm::vec2 u);

}  // namespace rcs
