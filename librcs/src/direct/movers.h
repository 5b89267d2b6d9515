#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lamps/lights.h"
#include "rcs/scene.h"

namespace rcs {

/// What has moved since some scene, and whether it may stand between a point and a lamp, or may have stood there.
class Movers {
public:
    /// @param boxes  around what moved, as it was and as it is   @param sky_has_peaks  which shine from everywhere
    Movers(std::span<const Bounds> boxes, const Lights& lights, bool sky_has_peaks);

    /// Whether light of any lamp may be another at the point; if in doubt it is. @param point  scene space [m]
    bool touch(glm::vec3 point) const;

private:
    struct Sphere {
        glm::vec3 centre;
        float radius;
    };

    static bool lies_between(glm::vec3 point, const Sphere& lamp, const Sphere& thing);

    std::vector<Sphere> lamps_;
    std::vector<Sphere> things_;  // around each box, and then eight around its eighths
    bool everywhere_ = false;
};

}  // namespace rcs
