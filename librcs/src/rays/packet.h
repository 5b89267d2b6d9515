#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

#include "rcs/ray_scene.h"

namespace rcs {

/// Sixteen rays in the layout of Embree's ray packets, so that they are traced in place. Directions
/// should be alike (neighbouring strata); the order of the lanes is free.
struct alignas(64) RayPacket {
    static constexpr int kWidth = 16;
    static constexpr std::uint32_t kMiss = 0xffffffffu;

    float origin_x[kWidth], origin_y[kWidth], origin_z[kWidth];
    float t_min[kWidth];
    float direction_x[kWidth], direction_y[kWidth], direction_z[kWidth];
    float time[kWidth];
    float t_max[kWidth];  ///< after tracing: the hit's distance; after occlusion: -inf where blocked
    std::uint32_t mask[kWidth];
    std::uint32_t id[kWidth];
    std::uint32_t flags[kWidth];
};

struct alignas(64) HitPacket {
    RayPacket ray;
    float normal_x[RayPacket::kWidth], normal_y[RayPacket::kWidth],
        normal_z[RayPacket::kWidth];  ///< not unit, object space
    float u[RayPacket::kWidth], v[RayPacket::kWidth];
    std::uint32_t primitive[RayPacket::kWidth];
    std::uint32_t geometry[RayPacket::kWidth];     ///< kMiss where nothing was hit
    std::uint32_t instance_id[RayPacket::kWidth];  ///< of an Embree instance, kMiss where the mesh is baked
    std::uint32_t padding[RayPacket::kWidth];      ///< Embree 4 keeps the member of an instance array here

    /// Index into Scene::instances of lane i's hit.
    std::uint32_t instance(int i) const { return instance_id[i] != RayPacket::kMiss ? instance_id[i] : geometry[i]; }
};

/// Sets what every ray shares: no time, all geometry, t_min 0.
void reset(RayPacket& packet);

/// Puts a ray into a lane; its t_min counts as 0.
inline void set_lane(RayPacket& packet, std::size_t lane, const Ray& ray)
{
    packet.origin_x[lane] = ray.origin.x;
    packet.origin_y[lane] = ray.origin.y;
    packet.origin_z[lane] = ray.origin.z;
    packet.direction_x[lane] = ray.direction.x;
    packet.direction_y[lane] = ray.direction.y;
    packet.direction_z[lane] = ray.direction.z;
    packet.t_max[lane] = ray.t_max;
}

inline glm::vec3 ray_direction(const RayPacket& ray, int lane)
{
    return {ray.direction_x[lane], ray.direction_y[lane], ray.direction_z[lane]};
}

inline glm::vec3 ray_origin(const RayPacket& ray, int lane)
{
    return {ray.origin_x[lane], ray.origin_y[lane], ray.origin_z[lane]};
}

/// What becomes of rays at surfaces that let light through. Masked texels below the cutoff never stop one.
enum class RayFilter {
    by_chance,  ///< goes on with the probability of the transmittance's largest channel; unbiased with the ray's weight
    everything,  ///< ends at each of them
};

/// What the light that comes along each lane's ray is to be multiplied by: the tint of what the ray went through,
/// over the probabilities of its passing and of its stopping. 1 in scenes without such surfaces.
struct LaneWeights {
    glm::vec3 weight[RayPacket::kWidth];
};

/// Traces the lanes whose bit is set in `active`; others keep their content. Rays go through surfaces by chance,
/// decided by a hash of ray and triangle: the same ray always meets the same surface.
void intersect(const RayScene& rays, std::uint32_t active, HitPacket& packet);
void intersect(const RayScene& rays, std::uint32_t active, HitPacket& packet, LaneWeights& weights);
void occluded(const RayScene& rays, std::uint32_t active, RayPacket& packet);
/// Without chance: what arrives of light along each ray, 0 where it is blocked.
void transmittance(const RayScene& rays, std::uint32_t active, RayPacket& packet, LaneWeights& transmitted);

/// The same for single rays. @param weight  set if not null
std::optional<Hit> intersect(const RayScene& rays, const Ray& ray, RayFilter filter, glm::vec3* weight = nullptr);
glm::vec3 transmittance(const RayScene& rays, const Ray& ray);

}  // namespace rcs
