#pragma once

#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "rcs/gbuffer.h"

namespace rcs {

/// How the visible points of a G-buffer reflect, where that takes more than their albedo.
struct Shading {
    std::vector<Bsdf> bsdf;  ///< per pixel; empty if all surfaces are Lambertian
};

/// Unit direction from a covered pixel's point to the viewer.
inline glm::vec3 outgoing_at(const GBuffer& g, const Camera& camera, std::size_t pixel)
{
    if (camera.projection == Projection::orthographic)
        return glm::vec3(glm::normalize(glm::dvec3(camera.world_from_view[2])));
    return -glm::normalize(g.position(pixel));
}

}  // namespace rcs
