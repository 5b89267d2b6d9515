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

/// Whether a material can have nothing but diffuse reflection and emission, textures or not.
inline bool is_lambertian(const Material& m)
{
    bool any = false;
    for_each_kind([&](auto kind, std::uint8_t) {
        any = any || (!kind.is_diffuse && kind.may_be(m, [](const TextureSlot&, int) { return 1.0f; }));
    });
    return !any;
}

/// Adds the lobes of a material. @param base_color  in [0, 1], looked up   @param look_up  as of MaterialPoint
/// @param lets_rays_pass  whether lobes are made through which rays go straight on
template <typename Lookup>
void make_lobes(const Material& m, glm::vec3 base_color, const Lookup& look_up, bool lets_rays_pass, Bsdf& bsdf)
{
    if (is_lambertian(m)) {
        bsdf.add(make_lobe<Diffuse>(base_color));
        return;
    }
    MaterialPoint<Lookup> point(m, look_up, base_color, lets_rays_pass);
    for_each_kind([&](auto kind, std::uint8_t number) {
        kind.make(point, [&](glm::vec3 color, float level, float alpha) { bsdf.add({color, level, alpha, number}); });
    });
}

}  // namespace rcs
