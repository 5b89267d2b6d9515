#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "material/bsdf.h"
#include "rcs/ray_scene.h"

namespace rcs {

struct SurfacePoint;

/// The texture area that a lookup averages over: derivatives of Mesh::uvs in two directions across a pixel or a
/// ray's cone. Zero: one bilinear lookup at full size.
struct TextureFilter {
    glm::vec2 duv_dx{0.0f}, duv_dy{0.0f};
    bool mean = false;  ///< of the whole texture instead
};

/// What a material is at one point, all textures and vertex colours looked up.
struct MaterialValues {
    Bsdf bsdf;                 ///< normals turned to the side of `point`; if the material has a glossy lobe or a normal
                               ///< map, the mirror direction of the viewer lies above the surface
    glm::vec3 emission{0.0f};  ///< radiance towards the viewer (unlit: its base colour)
    float alpha = 1.0f;        ///< coverage: 1 for opaque, 0 or 1 for masked materials
};

/// @param direction  unit, from the point towards the viewer
MaterialValues material_at(const RayScene& rays, const Hit& hit, const SurfacePoint& point, glm::vec3 direction,
                           const TextureFilter& filter);

/// Coverage alone: quick, for rays that pass through.
float alpha_at(const Scene& scene, const Mesh& mesh, std::uint32_t primitive, float u, float v);

}  // namespace rcs
