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
    struct Lamp {
        glm::vec3 corner[3];
        Sphere around;
    };
    struct Thing {
        glm::vec3 half;  // of the box's edges
        Sphere around;
    };

    static bool lies_between(glm::vec3 point, const Sphere& lamp, const Sphere& thing);
    static bool meets_hull(glm::vec3 point, const Lamp& lamp, const Thing& thing);

    std::vector<Lamp> lamps_;
    std::vector<Thing> things_;
    bool everywhere_ = false;
};

}  // namespace rcs
