#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include <glm/glm.hpp>

#include "rays/surface_material.h"
#include "rcs/ray_scene.h"
#include "rcs/scene.h"

namespace rcs {

/// A point on a surface, seen from some direction; normals are turned to the side it is seen from.
struct SurfacePoint {
    glm::vec3 position;          ///< scene space [m]
    float position_error;        ///< bound of the rounding error of `position` [m]
    glm::vec3 geometric_normal;  ///< unit
    glm::vec3 shading_normal;    ///< unit, same side as the geometric one
    glm::vec2 uv;                ///< 0 if the mesh has none
    int material;
    bool front;  ///< seen from the front (counter-clockwise) side
};

/// The same point for light from the other side.
inline SurfacePoint other_side(SurfacePoint point)
{
    point.geometric_normal = -point.geometric_normal;
    point.shading_normal = -point.shading_normal;
    point.front = !point.front;
    return point;
}

/// The triangle's corners in scene space, as the rays see them.
std::array<glm::vec3, 3> triangle_corners(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive);

/// @param u, v  barycentric weights of the second and third corner
/// @param direction  of the ray that sees the point (towards the surface)
SurfacePoint surface_at(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive, float u, float v,
                        glm::vec3 direction);

/// A ray that starts on the surface and does not meet it again because of rounding: the origin is
/// moved along the geometric normal by the position's error bound, to the side `direction` goes.
inline Ray ray_from(const SurfacePoint& point, glm::vec3 direction,
                    float t_max = std::numeric_limits<float>::infinity())
{
    const bool outwards = glm::dot(direction, point.geometric_normal) >= 0.0f;
    const float offset = outwards ? point.position_error : -point.position_error;
    return {point.position + offset * point.geometric_normal, direction, 0.0f, t_max};
}

/// A ray from the surface to a lamp without size `distance` away, which may be fixed to a surface of its own.
inline Ray shadow_ray_from(const SurfacePoint& point, glm::vec3 to_light, float distance)
{
    // Both ends are rounded; the far one by about as much as the near one, and by a few ulps of the way.
    constexpr float kRelativeEnd = 1.0f - 0x1p-16f;
    return ray_from(point, to_light, std::max(0.0f, kRelativeEnd * distance - 2.0f * point.position_error));
}

/// Corners of a triangle as texture footprints need it.
std::array<glm::vec2, 3> triangle_uvs(const Scene& scene, std::uint32_t instance, std::uint32_t primitive);

/// What a pixel's sample sees at the camera ray's meeting with a triangle's plane.
struct VisiblePoint {
    SurfacePoint surface;
    glm::vec3 relative_position;  ///< to the camera's position, from double precision [m]
    double distance;              ///< along the unit camera ray from its origin [m]
    float footprint;              ///< sqrt of the surface area that one pixel covers [m]
    MaterialValues material;      ///< textures filtered over the pixel
    glm::vec3 albedo;             ///< of the diffuse reflection towards the camera
    glm::vec3 emission;           ///< radiance towards the camera
};
/// @param texture_scale  width of the texture filter in pixels
VisiblePoint visible_point(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive,
                           const CameraRay& camera_ray, glm::dvec3 camera_position, float texture_scale);

/// The first surface on the camera ray whose side there the camera sees, masked texels left out; blended and
/// transmitting surfaces are found one after the other.
/// @param after  Hit::t of the surface before; 0: none
std::optional<Hit> find_visible(const RayScene& rays, const CameraRay& camera_ray, float after = 0.0f);

/// How far inside a triangle the camera ray meets its plane: distance to the nearest edge in pixels, negative
/// outside; -inf where the ray does not meet the plane in front of the camera.
double pixels_inside(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive,
                     const CameraRay& camera_ray);

/// Whether the camera sees this side of the surface (glTF culls the backs of single-sided materials).
inline bool camera_sees(const Material& material, bool front) { return front || material.double_sided; }

/// Radiance that leaves the surface by emission on the side it is seen from.
inline glm::vec3 emitted_radiance(const Material& material, bool front)
{
    return front || material.double_sided ? material.emission : glm::vec3(0.0f);
}

}  // namespace rcs
