#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A ray of light, or towards it.
struct Ray {
    glm::vec3 origin;                                      ///< scene space [m]
    glm::vec3 direction;                                   ///< need not be unit; distances are in its units
    float t_min = 0.0f;                                    ///< where it begins, >= 0
    float t_max = std::numeric_limits<float>::infinity();  ///< where it ends
};

/// Where a ray meets a surface.
struct Hit {
    float t = 0.0f;               ///< distance, in units of the ray's direction
    float u = 0.0f;               ///< barycentric weight of the triangle's second vertex
    float v = 0.0f;               ///< ... and of its third one
    std::uint32_t instance = 0;   ///< index into Scene::instances
    std::uint32_t primitive = 0;  ///< index into Mesh::triangles
};

/// The scene as rays see it: an Embree acceleration structure. Meshes that are used once are baked
/// into scene space, others are Embree instances. Refers to the Scene it was built from, which must
/// outlive it and stay unchanged.
class RCS_API RayScene {
public:
    struct Impl;
    /// build_ray_scene() makes it.
    explicit RayScene(std::unique_ptr<Impl> impl);
    ~RayScene();
    /// Takes over what the other holds, which is of no use then.
    RayScene(RayScene&&) noexcept;
    /// The same, in place of what this one held.
    RayScene& operator=(RayScene&&) noexcept;

    /// That it was built from.
    const Scene& scene() const noexcept;
    /// Of all instances.
    std::size_t triangle_count() const noexcept;
    /// Whether rays ask any surface if they may go on: for an alpha mask, for blending, or as a thin transmitting wall.
    bool has_transparency() const noexcept;
    /// For the library's own use.
    const Impl& impl() const noexcept { return *impl_; }
    /// For the library's own use.
    Impl& impl() noexcept { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

struct EffectChoice;

/// Surfaces are asked for what they let through where their textures, factors or vertex colours say that they may.
/// @throws Error out_of_memory, internal (what Embree reported)
RCS_API RayScene build_ray_scene(const Scene& scene, const ThreadPool& pool);
/// The same, with transmission, alpha, normal maps and instancing also where the user says so.
RCS_API RayScene build_ray_scene(const Scene& scene, const ThreadPool& pool, const EffectChoice& effects);

/// Nearest hit along the ray, both sides of every triangle. Watertight (Embree's robust mode). Surfaces that let
/// light through stop a ray by chance, which is decided by a hash of ray and triangle.
RCS_API std::optional<Hit> intersect(const RayScene& rays, const Ray& ray);
/// Whether anything lies on the ray between t_min and t_max.
RCS_API bool occluded(const RayScene& rays, const Ray& ray);

}  // namespace rcs
