#pragma once

#include <algorithm>
#include <cmath>

#include "rays/packet.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface.h"

namespace rcs {

// Interpolating a position from three corners, and moving it along a normal, costs a handful of
// roundings of half an ulp each (Pharr, Jakob, Humphreys: PBRT 3.9); twice that for Embree's own
// arithmetic on the same corners.
inline constexpr float kPositionRoundings = 16.0f;
inline constexpr float kUnitRoundoff = 0x1p-24f;

inline float max_component(glm::vec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

inline const RayInstance& instance_of(const RayScene& rays, std::uint32_t instance)
{
    return rays.impl().instances[instance];
}

/// Whether a packet's ray met a face whose normals turn.
inline bool is_curved(const RayScene& rays, const HitPacket& packet, int lane)
{
    return instance_of(rays, packet.instance(lane)).is_curved(packet.primitive[lane]);
}

inline glm::vec3 unit_or(glm::vec3 v, glm::vec3 fallback)
{
    const float length2 = glm::dot(v, v);
    // Also false for NaN; lengths beyond 2^60 or below 2^-60 have no meaning in a scene.
    return length2 > 0x1p-120f && length2 < 0x1p120f ? v * (1.0f / std::sqrt(length2)) : fallback;
}

/// A unit normal like `shading` that leans no further from the surface than this cosine: beyond it, hardly any of its
/// hemisphere lies outside. @param geometric  unit, of the side that is seen
inline glm::vec3 bend_towards(glm::vec3 shading, glm::vec3 geometric)
{
    constexpr float kLeast = 0.1f;
    const float agreement = glm::dot(shading, geometric);
    if (agreement >= kLeast) return shading;
    const glm::vec3 tangent = unit_or(shading - agreement * geometric, glm::vec3(0.0f));
    return unit_or(std::sqrt(1.0f - kLeast * kLeast) * tangent + kLeast * geometric, geometric);
}

/// The faces that a packet's rays hit, all lanes at once; lanes without a hit hold anything finite or not.
struct alignas(64) FacePacket {
    float normal_x[RayPacket::kWidth], normal_y[RayPacket::kWidth],
        normal_z[RayPacket::kWidth];  ///< unit, towards the ray's origin
    /// q of the face's plane: it lies at distance 1/(q.w) along any unit direction w [1/m]
    float plane_x[RayPacket::kWidth], plane_y[RayPacket::kWidth], plane_z[RayPacket::kWidth];
    float facing[RayPacket::kWidth];  ///< > 0 where the ray meets the face's counter-clockwise side
};
void find_faces(const RayScene& rays, const HitPacket& packet, FacePacket& faces);

/// A packet ray's hit, step by step: the same surface as surface_at(), from one cache line per triangle, its
/// position taken from the ray (as exact as the ray is short).
struct HitSurface {
    SurfacePoint point;   ///< shading normal and uv are set by complete_hit()
    float uv_per_length;  ///< texture space per scene length [1/m], for the choice of a mip level; by complete_hit()
};

/// First what the packet itself knows ...
inline HitSurface begin_hit(const RayScene& rays, const HitPacket& packet, const FacePacket& faces, int lane)
{
    const RayInstance& i = instance_of(rays, packet.instance(lane));
    const RayPacket& ray = packet.ray;
    const glm::vec3 direction(ray.direction_x[lane], ray.direction_y[lane], ray.direction_z[lane]);
    const glm::vec3 origin(ray.origin_x[lane], ray.origin_y[lane], ray.origin_z[lane]);
    HitSurface hit;
    // A baked mesh has its corners in scene space, where mirroring has turned their order.
    hit.point.front = (faces.facing[lane] > 0.0f) != (i.mirrored && !i.instanced);
    hit.point.geometric_normal = {faces.normal_x[lane], faces.normal_y[lane], faces.normal_z[lane]};
    hit.point.position = origin + ray.t_max[lane] * direction;
    hit.point.position_error = kPositionRoundings * kUnitRoundoff * (max_component(origin) + ray.t_max[lane]);
    hit.point.material = i.material;
    return hit;
}

/// ... then, for hits that matter, the rest. prefetch_hit() asks for its memory: hits lie anywhere in the scene.
inline void prefetch_hit(const RayScene& rays, const HitPacket& packet, int lane)
{
    __builtin_prefetch(&instance_of(rays, packet.instance(lane)).triangles[packet.primitive[lane]]);
}
void complete_hit(const RayScene& rays, const HitPacket& packet, int lane, HitSurface& hit);

}  // namespace rcs
