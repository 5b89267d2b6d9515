#include "rays/surface_material.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "material/material_lobes.h"
#include "material/normal_map.h"
#include "rays/hit_surface.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "scene/texture.h"
#include "util/basis.h"
#include "util/counters.h"

namespace rcs {
namespace {

template <typename Value>
Value interpolated(const std::vector<Value>& values, glm::uvec3 t, float u, float v)
{
    return (1.0f - u - v) * values[t.x] + u * values[t.y] + v * values[t.z];
}

std::array<glm::vec2, 3> corner_uvs(const Mesh& mesh, std::uint32_t primitive, int set)
{
    const std::vector<glm::vec2>& uvs = set == 0 ? mesh.uvs : mesh.uvs1;
    if (uvs.empty()) return {};
    const glm::uvec3 t = mesh.triangles[primitive];
    return {uvs[t.x], uvs[t.y], uvs[t.z]};
}

/// A filter in the second texture space like that in the first.
TextureFilter second_filter(const Mesh& mesh, std::uint32_t primitive, const TextureFilter& first)
{
    const std::array<glm::vec2, 3> a = corner_uvs(mesh, primitive, 0), b = corner_uvs(mesh, primitive, 1);
    const glm::mat2 from_weights(a[1] - a[0], a[2] - a[0]);
    if (!(std::abs(glm::determinant(from_weights)) > 1e-20f)) return {};
    const glm::mat2 turned = glm::mat2(b[1] - b[0], b[2] - b[0]) * glm::inverse(from_weights);
    return {turned * first.duv_dx, turned * first.duv_dy};
}

/// Texture lookups at one point.
class Lookup {
public:
    Lookup(const Scene& scene, const Mesh& mesh, const Hit& hit, glm::vec2 uv, const TextureFilter& filter)
        : scene_(scene), mesh_(mesh), hit_(hit), uv_(uv), filter_(filter)
    {
    }

    /// 1 where the slot is empty.
    glm::vec4 operator()(const TextureSlot& slot) const
    {
        if (!slot.used()) return glm::vec4(1.0f);
        if (filter_.mean)
            return texel_value(scene_.textures[static_cast<std::size_t>(slot.texture)].levels.back(), 0, 0);
        if (slot.uv_set == 0) return sample_slot(scene_, slot, uv_, filter_.duv_dx, filter_.duv_dy);
        if (mesh_.uvs1.empty()) return sample_slot(scene_, slot, glm::vec2(0.0f), glm::vec2(0.0f), glm::vec2(0.0f));
        const glm::vec2 uv = interpolated(mesh_.uvs1, mesh_.triangles[hit_.primitive], hit_.u, hit_.v);
        const TextureFilter filter = second_filter(mesh_, hit_.primitive, filter_);
        return sample_slot(scene_, slot, uv, filter.duv_dx, filter.duv_dy);
    }

private:
    const Scene& scene_;
    const Mesh& mesh_;
    const Hit& hit_;
    glm::vec2 uv_;
    const TextureFilter& filter_;
};

float coverage(const Material& material, float alpha)
{
    switch (material.alpha_mode) {
        case AlphaMode::opaque:
            return 1.0f;
        case AlphaMode::mask:
            return alpha >= material.alpha_cutoff ? 1.0f : 0.0f;
        case AlphaMode::blend:
            return std::clamp(alpha, 0.0f, 1.0f);
    }
    return 1.0f;
}

/// The frame of normal textures in scene space, from the mesh's tangents or else from its texture coordinates.
TangentPair tangent_frame(const RayScene& rays, const Hit& hit, const Mesh& mesh, const TextureSlot& slot)
{
    if (!mesh.tangents.empty() && !mesh.normals.empty()) {
        const glm::uvec3 t = mesh.triangles[hit.primitive];
        const glm::vec4 tangent = interpolated(mesh.tangents, t, hit.u, hit.v);
        const glm::vec3 bitangent =
            tangent.w * glm::cross(interpolated(mesh.normals, t, hit.u, hit.v), glm::vec3(tangent));
        const glm::mat3 linear(rays.scene().instances[hit.instance].world_from_object);
        return {linear * glm::vec3(tangent), linear * bitangent};
    }
    std::array<glm::vec2, 3> uvs = corner_uvs(mesh, hit.primitive, slot.uv_set);
    for (glm::vec2& uv : uvs) uv = slot.texture_from_uv * glm::vec3(uv, 1.0f);
    return tangents_from_uvs(triangle_corners(rays, hit.instance, hit.primitive), uvs);
}

/// As normal maps are baked: what is interpolated is made neither unit nor orthogonal before the texel weighs it, and
/// an object's scale turns the result as it turns normals. Of the front side; 0 where it has no direction.
glm::vec3 baked_normal(const RayInstance& instance, const Mesh& mesh, const Hit& hit, glm::vec3 texel, float scale)
{
    const glm::uvec3 t = mesh.triangles[hit.primitive];
    const glm::vec3 normal = interpolated(mesh.normals, t, hit.u, hit.v);
    const glm::vec4 tangent = interpolated(mesh.tangents, t, hit.u, hit.v);
    const glm::vec3 bitangent = tangent.w * glm::cross(normal, glm::vec3(tangent));
    const glm::vec3 n = 2.0f * texel - 1.0f;
    const glm::vec3 bent = instance.normal_from_object *
                           (scale * n.x * glm::vec3(tangent) + scale * n.y * bitangent + std::max(n.z, 0.0f) * normal);
    const float length = glm::length(bent);
    return length > 0.0f ? bent / length : glm::vec3(0.0f);
}

glm::vec3 normal_at(const RayScene& rays, const Hit& hit, const Mesh& mesh, const Material& material,
                    const SurfacePoint& point, const Lookup& look_up)
{
    const RayInstance& instance = rays.impl().instances[hit.instance];
    if ((instance.simulated & kBumpy) == 0u) return point.shading_normal;
    tally(Count::normal_maps);
    const float side = point.front ? 1.0f : -1.0f;
    const glm::vec3 texel = look_up(material.normal_texture);
    if (!mesh.tangents.empty() && !mesh.normals.empty()) {
        const glm::vec3 normal = baked_normal(instance, mesh, hit, texel, material.normal_scale);
        return normal != glm::vec3(0.0f) ? side * normal : point.shading_normal;
    }
    return side * mapped_normal(side * point.shading_normal, tangent_frame(rays, hit, mesh, material.normal_texture),
                                texel, material.normal_scale);
}

/// What lobes are made from: texels, and directions on the surface.
struct LobeLookup {
    const Lookup& texel;
    const RayScene& rays;
    const Hit& hit;
    const Mesh& mesh;
    glm::vec3 front_normal, normal;  // the latter on the viewer's side

    glm::vec4 operator()(const TextureSlot& slot) const { return texel(slot); }
    float turn_of(const TextureSlot& slot, glm::vec2 direction) const
    {
        const glm::vec3 towards = mapped_direction(front_normal, tangent_frame(rays, hit, mesh, slot), direction);
        const Basis basis(normal);
        return std::atan2(glm::dot(towards, basis.y), glm::dot(towards, basis.x));
    }
};

}  // namespace

MaterialValues material_at(const RayScene& rays, const Hit& hit, const SurfacePoint& point, glm::vec3 direction,
                           const TextureFilter& filter)
{
    const Scene& scene = rays.scene();
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[hit.instance].mesh)];
    const Material& material = scene.materials[static_cast<std::size_t>(point.material)];
    const Lookup look_up(scene, mesh, hit, point.uv, filter);
    glm::vec4 base = glm::vec4(material.base_color, material.alpha) * look_up(material.base_color_texture);
    if (!mesh.colors.empty()) base *= interpolated(mesh.colors, mesh.triangles[hit.primitive], hit.u, hit.v);

    MaterialValues values;
    const std::uint32_t simulated = rays.impl().instances[hit.instance].simulated;
    values.alpha = (simulated & (kMasked | kBlended)) != 0u ? coverage(material, base.a) : 1.0f;
    values.bsdf.geometric_normal = point.geometric_normal;
    values.bsdf.normal = point.shading_normal;
    if (material.unlit) {
        values.emission = glm::vec3(base);
        return values;
    }
    values.emission = emitted_radiance(material, point.front);
    if (values.emission != glm::vec3(0.0f)) values.emission *= glm::vec3(look_up(material.emission_texture));
    const bool mirrors = !is_lambertian(material);
    if (mirrors || (simulated & kBumpy) != 0u) {
        const glm::vec3 normal = normal_at(rays, hit, mesh, material, point, look_up);
        values.bsdf.normal = mirrors ? keep_mirror_above(normal, point.geometric_normal, direction)
                                     : bend_towards(normal, point.geometric_normal);
    }
    const LobeLookup lobe_lookup{
        look_up, rays, hit, mesh, point.front ? values.bsdf.normal : -values.bsdf.normal, values.bsdf.normal};
    make_lobes(material, glm::clamp(glm::vec3(base), 0.0f, 1.0f), lobe_lookup, (simulated & kTransmits) != 0u,
               values.bsdf);
    return values;
}

float alpha_at(const Scene& scene, const Mesh& mesh, std::uint32_t primitive, float u, float v)
{
    const Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
    if (material.alpha_mode == AlphaMode::opaque) return 1.0f;
    float alpha = material.alpha;
    const glm::uvec3 t = mesh.triangles[primitive];
    const TextureSlot& slot = material.base_color_texture;
    if (slot.used()) {
        const std::vector<glm::vec2>& uvs = slot.uv_set == 0 ? mesh.uvs : mesh.uvs1;
        const glm::vec2 uv = uvs.empty() ? glm::vec2(0.0f) : interpolated(uvs, t, u, v);
        alpha *= sample_slot(scene, slot, uv, glm::vec2(0.0f), glm::vec2(0.0f)).a;
    }
    if (!mesh.colors.empty()) alpha *= interpolated(mesh.colors, t, u, v).a;
    return coverage(material, alpha);
}

}  // namespace rcs
