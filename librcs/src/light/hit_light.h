#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "light/candidates.h"
#include "light/lights.h"
#include "scene/surface.h"
#include "util/random.h"

namespace rcs {

/// The lamps as gather hits see them: one of them is chosen per hit, in proportion to an estimate of what
/// it would send if nothing stood between.
class HitLights {
public:
    explicit HitLights(const Lights& lights);

    /// One shadow ray to shoot: light that arrives over it if nothing blocks it, divided by the chance of the choice.
    struct Sample {
        glm::vec3 irradiance{0.0f};  ///< [W m^-2]; 0: nothing to shoot
        glm::vec3 to_light{0.0f};    ///< unit
        float distance = 0.0f;       ///< [m], may be +inf
    };
    /// @param choice  in [0, 1): which lamp   @param random  further numbers
    Sample sample(const SurfacePoint& point, float choice, RandomStream& random) const;

private:
    float estimate(std::uint32_t light, const SurfacePoint& point) const;
    Sample sample_triangle(const EmissiveTriangle& triangle, const SurfacePoint& point, RandomStream& random) const;

    Lights lights_;
    std::vector<glm::vec4> bounding_spheres_;  // of the triangles: centre, radius
    LampCandidates candidates_;
};

}  // namespace rcs
