#pragma once

#include <array>

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "util/basis.h"

namespace rcs {

/// How something changes, per channel, along x and y of a frame [1/m].
using ChangeAlong = std::array<glm::vec3, 2>;

/// Directions in which a surface is seen from places beside the one that sees it, which its narrow lobes look different
/// in: diffuse surfaces are the same from everywhere, wide lobes about, and thin layers above light ones.
class MovingViews {
public:
    /// @param bsdf  has to outlive this   @param outgoing  unit, towards the place   @param distance  of that [m], >= 0
    /// @param frame  of moves of the place
    MovingViews(const Bsdf& bsdf, glm::vec3 outgoing, float distance, const Basis& frame);

    /// Of pi times the BSDF, as the place moves. @param incoming  unit
    ChangeAlong change(glm::vec3 incoming) const;

private:
    const Bsdf& bsdf_;
    float scale_ = 0.0f;            // from a difference to the change [1/m]; 0: there is none
    glm::vec3 ahead_[2], back_[2];  // unit
};

}  // namespace rcs
