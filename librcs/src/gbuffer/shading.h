#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "rcs/camera.h"
#include "rcs/effect_plan.h"
#include "rcs/gbuffer.h"

namespace rcs {

/// How the visible points of a G-buffer reflect, where that takes more than their albedo, and what shows behind them.
struct Shading {
    std::vector<Bsdf> bsdf;       ///< per pixel; empty if no lobe is simulated
    std::vector<float> coverage;  ///< part of the pixel that the surface fills; empty if none is looked behind, as is
    std::vector<glm::vec3> through;  ///< the colour that comes straight through the surface
};

/// Triangles that need no shading where a pixel sees them: their light is known.
struct KnownSamples {
    std::vector<std::uint32_t> instance, primitive;  ///< per pixel; kNone: nothing is known
    std::vector<std::uint8_t> met;  ///< 1 where the last G-buffer saw what was known, and left the pixel empty
};

/// render_gbuffer() of gbuffer.h, and how its points reflect as far as the effects ask for it: highlights, glossy
/// records and traced lobes for BSDFs, peeling for what shows behind.
/// @param known  may be null
GBuffer render_gbuffer(GlContext& gl, const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool,
                       const EffectSet& effects, Shading& shading, KnownSamples* known = nullptr);

/// The next surfaces behind those of `gbuffer`, where `weight` says that they matter: replaces both buffers.
/// @param weight  per pixel: how much of the light from there reaches the camera; 0: the pixel becomes empty and black
void peel_gbuffer(const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool,
                  const std::vector<glm::vec3>& weight, GBuffer& gbuffer, Shading& shading);

/// Unit direction from a covered pixel's point to the viewer.
inline glm::vec3 outgoing_at(const GBuffer& g, const Camera& camera, std::size_t pixel)
{
    if (camera.projection == Projection::orthographic)
        return glm::vec3(glm::normalize(glm::dvec3(camera.world_from_view[2])));
    return -glm::normalize(g.position(pixel));
}

}  // namespace rcs
