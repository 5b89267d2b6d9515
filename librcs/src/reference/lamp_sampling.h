#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "light/lights.h"
#include "light/polygon.h"
#include "scene/surface.h"

namespace rcs {

/// The points of one path: pair n of the path is point `index` of the n-th padded Sobol' sequence.
struct PathPoints {
    std::uint32_t index = 0;
    std::uint64_t key = 0;
    glm::vec2 pair(int n) const;
};

/// Cosine of a direction to the shading normal where it is above both horizons, else 0.
inline float receiving_cosine(const SurfacePoint& point, glm::vec3 unit_direction)
{
    return glm::dot(unit_direction, point.geometric_normal) > 0.0f
               ? glm::max(0.0f, glm::dot(unit_direction, point.shading_normal))
               : 0.0f;
}

/// The lamps as one point sees them: how much each would add if nothing stood between.
struct LampsAtPoint {
    std::vector<PunctualSample> punctual;  ///< those with something to add
    std::vector<std::uint32_t> triangles;  ///< the same, indices into Lights::triangles
    std::vector<float> cumulative;         ///< of contributions, punctual lamps first
};

enum class Lamps { all, with_area };
void weigh_lamps(const Lights& lights, const SurfacePoint& point, Lamps which, LampsAtPoint& result);

/// Irradiance from one lamp, chosen in proportion to its weight, divided by its probability: unbiased.
/// Uses pair `n` of the path's points if there is anything to choose.
glm::vec3 sample_lamp(const RayScene& rays, const Lights& lights, const SurfacePoint& point,
                      const LampsAtPoint& lamps, const PathPoints& points, int n);

/// Irradiance from all punctual lights, shadows included: exact.
glm::vec3 punctual_irradiance(const RayScene& rays, const Lights& lights, const SurfacePoint& point);

}  // namespace rcs
