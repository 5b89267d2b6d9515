#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/effect_plan.h"
#include "rcs/ray_scene.h"
#include "scene/environment.h"
#include "scene/mesh_traits.h"

namespace rcs {

struct EmbreeScene;
struct Lights;

/// What shading a hit on one triangle needs, on one cache line. Object space.
struct alignas(64) HitTriangle {
    glm::vec3 normal[3];  ///< at the corners, unit; the face's own where the mesh has none
    glm::vec2 uv[3];
    float signed_uv_density;  ///< texture space per object length [1/m]; the sign bit marks a flat triangle

    float uv_density() const { return std::abs(signed_uv_density); }
    /// All three normals are the face's own, as on walls: there is nothing to interpolate.
    bool is_flat() const { return std::signbit(signed_uv_density); }
};
static_assert(sizeof(HitTriangle) == 64);

/// One Instance as hits see it.
struct RayInstance {
    const Mesh* mesh = nullptr;
    const HitTriangle* triangles = nullptr;  ///< of the mesh
    int material = 0;
    float inverse_scale = 1.0f;        ///< 1 / the transform's mean stretch
    bool smooth = false;               ///< the mesh has vertex normals
    bool mirrored = false;             ///< the transform turns front faces clockwise
    bool instanced = false;            ///< traced through an Embree instance; else baked into scene space
    std::uint32_t simulated = 0;       ///< the mesh's, as below
    std::vector<glm::vec3> positions;  ///< baked: corners in scene space, and one more element at the end
    glm::mat4x3 scene_from_object{1.0f};
    glm::mat3 normal_from_object{1.0f};  ///< object normals to scene space, not unit

    /// Whether the triangle's normals turn across it.
    bool is_curved(std::uint32_t triangle) const { return smooth && !triangles[triangle].is_flat(); }
};

struct [[gnu::visibility("hidden")]] RayScene::Impl {
    const Scene* scene = nullptr;
    std::unique_ptr<EmbreeScene> embree;
    std::vector<RayInstance> instances;
    std::vector<std::vector<HitTriangle>> hit_triangles;   ///< per mesh
    std::vector<std::vector<glm::vec3>> object_positions;  ///< per mesh, of those that are instanced
    std::size_t triangle_count = 0;
    bool has_transparency = false;
    EffectChoice choice;                   ///< that the scene was built for
    std::vector<MeshTraits> traits;        ///< per mesh
    std::vector<std::uint32_t> simulated;  ///< per mesh: simulated_traits()
    std::vector<Bounds> bounds;            ///< per mesh, object space
    Environment environment;
    std::shared_ptr<const Lights> lights;  ///< set by build_ray_scene(): lamps are found by their surfaces

    Impl();
    ~Impl();
};

/// All of a RayScene but its lamps. @throws Error as build_ray_scene()
std::unique_ptr<RayScene::Impl> make_ray_scene(const Scene& scene, const ThreadPool& pool, const EffectChoice& effects);

/// The sky of the scene, prepared for lookups and sampling.
inline const Environment& environment_of(const RayScene& rays) { return rays.impl().environment; }

}  // namespace rcs
