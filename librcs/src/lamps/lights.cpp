#include "lamps/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lamps/light_tree.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "rays/surface_material.h"
#include "scene/environment.h"

namespace rcs {
namespace {

/// What leaves a triangle's emitting side at a point, its coverage counted in.
glm::vec3 emission_at(const RayScene& rays, const EmissiveTriangle& triangle, float u, float v,
                      const TextureFilter& filter)
{
    const SurfacePoint point = surface_at(rays, triangle.instance, triangle.primitive, u, v, -triangle.normal);
    const Hit hit{0.0f, u, v, triangle.instance, triangle.primitive};
    const MaterialValues values = material_at(rays, hit, point, triangle.normal, filter);
    return values.alpha * values.emission;
}

/// Mean over 16 equal parts of the triangle, each filtered over its own size: no texel is left out.
glm::vec3 mean_radiance(const RayScene& rays, const EmissiveTriangle& triangle)
{
    const std::array<glm::vec2, 3> uv = triangle_uvs(rays.scene(), triangle.instance, triangle.primitive);
    const TextureFilter filter{0.25f * (uv[1] - uv[0]), 0.25f * (uv[2] - uv[0])};
    glm::vec3 sum(0.0f);
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; i + j < 4; ++j) {
            const float u = (static_cast<float>(i) + 1.0f / 3.0f) / 4.0f,
                        v = (static_cast<float>(j) + 1.0f / 3.0f) / 4.0f;
            sum += emission_at(rays, triangle, u, v, filter);
            if (i + j < 3)  // the part that stands on its head
                sum += emission_at(rays, triangle, u + 1.0f / 12.0f, v + 1.0f / 12.0f, filter);
        }
    }
    return sum / 16.0f;
}

float longest_edge(const std::array<glm::vec3, 3>& corners)
{
    return std::max({glm::distance(corners[0], corners[1]), glm::distance(corners[1], corners[2]),
                     glm::distance(corners[2], corners[0])});
}

/// Appends the mesh's triangles that have area. Which side is the front is asked of surface_at(), so
/// that lamps and rays agree also on mirrored instances.
void append_emissive_triangles(const RayScene& rays, std::uint32_t instance, const Mesh& mesh, const Material& material,
                               Lights& lights)
{
    lights.first_of_instance[instance] = static_cast<std::uint32_t>(lights.triangle_of_primitive.size());
    lights.triangle_of_primitive.resize(lights.triangle_of_primitive.size() + mesh.triangles.size(), Lights::kNone);
    for (std::uint32_t primitive = 0; primitive < mesh.triangles.size(); ++primitive) {
        const auto corners = triangle_corners(rays, instance, primitive);
        const glm::dvec3 cross = glm::cross(glm::dvec3(corners[1]) - glm::dvec3(corners[0]),
                                            glm::dvec3(corners[2]) - glm::dvec3(corners[0]));
        const double length = glm::length(cross);
        EmissiveTriangle triangle;
        triangle.area = static_cast<float>(0.5 * length);
        if (!(triangle.area > 0.0f)) continue;

        std::copy(corners.begin(), corners.end(), triangle.corner);
        triangle.normal = glm::vec3(cross / length);
        constexpr float kThird = 1.0f / 3.0f;
        const SurfacePoint middle = surface_at(rays, instance, primitive, kThird, kThird, -triangle.normal);
        if (!middle.front) triangle.normal = -triangle.normal;
        triangle.error = middle.position_error + kPlaneRounding * longest_edge(corners);
        triangle.radiance = material.emission;
        triangle.double_sided = material.double_sided;
        triangle.instance = instance;
        triangle.primitive = primitive;
        triangle.varied = material.emission_texture.used() || material.alpha_mode != AlphaMode::opaque;
        if (triangle.varied) triangle.radiance = mean_radiance(rays, triangle);
        if (triangle.radiance == glm::vec3(0.0f)) continue;
        lights.triangle_of_primitive[lights.first_of_instance[instance] + primitive] =
            static_cast<std::uint32_t>(lights.triangles.size());
        lights.triangles.push_back(triangle);
    }
}

/// Fade towards the end of the range and the edge of the cone, as KHR_lights_punctual recommends.
double range_attenuation(double distance, double range)
{
    const double ratio = distance / range;
    return std::clamp(1.0 - ratio * ratio * ratio * ratio, 0.0, 1.0);
}

double cone_attenuation(const PunctualLight& light, double cos_angle)
{
    const double cos_inner = std::cos(static_cast<double>(light.inner_cone));
    const double cos_outer = std::cos(static_cast<double>(light.outer_cone));
    // The extension's own guard against cones without a soft edge.
    const double width = std::max(0.001, cos_inner - cos_outer);
    const double edge = std::clamp((cos_angle - cos_outer) / width, 0.0, 1.0);
    return edge * edge;
}

}  // namespace

Lights find_lights(const RayScene& rays)
{
    const Scene& scene = rays.scene();
    Lights lights;
    lights.punctual.assign(scene.lights.begin(), scene.lights.end());
    lights.sky_radiance = scene.sky_radiance;
    lights.sky = &environment_of(rays);
    lights.first_of_instance.assign(scene.instances.size(), Lights::kNone);
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[i].mesh)];
        const Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
        if (material.emission != glm::vec3(0.0f) && !material.unlit)
            append_emissive_triangles(rays, i, mesh, material, lights);
    }
    lights.tree = std::make_shared<const LightTree>(lights.triangles);
    return lights;
}

Lights collect_lights(const RayScene& rays)
{
    Lights lights = *rays.impl().lights;
    lights.rays = &rays;
    return lights;
}

Lights collect_lights(const RayScene& rays, const EffectSet& effects)
{
    Lights lights = collect_lights(rays);
    if (!effects.has(Effect::punctual_light)) lights.punctual.clear();
    if (!effects.has(Effect::area_light) && !lights.triangles.empty()) {
        lights.triangles.clear();
        lights.first_of_instance.assign(lights.first_of_instance.size(), Lights::kNone);
        lights.tree = std::make_shared<const LightTree>(lights.triangles);
    }
    if (!effects.has(Effect::environment_peaks)) lights.sky = nullptr;
    return lights;
}

bool Lights::has_peaks() const { return sky && sky->has_peaks(); }

glm::vec3 radiance_at(const RayScene& rays, const EmissiveTriangle& triangle, glm::vec3 position)
{
    if (!triangle.varied) return triangle.radiance;
    const glm::vec3 e1 = triangle.corner[1] - triangle.corner[0], e2 = triangle.corner[2] - triangle.corner[0];
    const glm::vec3 n = glm::cross(e1, e2), s = position - triangle.corner[0];
    const float inverse = 1.0f / glm::dot(n, n);
    const float u = std::clamp(glm::dot(glm::cross(s, e2), n) * inverse, 0.0f, 1.0f);
    const float v = std::clamp(glm::dot(glm::cross(e1, s), n) * inverse, 0.0f, 1.0f - u);
    return emission_at(rays, triangle, u, v, {});
}

bool lies_on_plane(const EmissiveTriangle& triangle, const SurfacePoint& point)
{
    const float height = std::abs(glm::dot(triangle.normal, triangle.corner[0] - point.position));
    return height <= 2.0f * point.position_error + triangle.error;
}

PunctualLamp::PunctualLamp(const PunctualLight& light)
    : PunctualLight(light),
      cos_inner(std::cos(static_cast<double>(light.inner_cone))),
      cos_outer(std::cos(static_cast<double>(light.outer_cone)))
{
}

PunctualSample sample_punctual(const PunctualLamp& light, glm::vec3 point)
{
    if (light.kind == LightKind::directional)
        return {light.intensity, glm::vec3(-light.direction), std::numeric_limits<float>::infinity()};

    const glm::dvec3 offset = light.position - glm::dvec3(point);
    const double distance = glm::length(offset);
    if (!(distance > 0.0)) return {glm::vec3(0.0f), glm::vec3(0.0f, 0.0f, 1.0f), 0.0f};

    const glm::dvec3 to_light = offset / distance;
    const double range = static_cast<double>(light.range);
    double strength = range_attenuation(distance, range) / (distance * distance);
    if (light.kind == LightKind::spot) strength *= cone_attenuation(light, -glm::dot(to_light, light.direction));
    // A lamp on the surface itself must not overflow what is summed later.
    constexpr double kMaxIrradiance = 1e30;
    const glm::dvec3 irradiance = glm::min(glm::dvec3(light.intensity) * strength, kMaxIrradiance);
    return {glm::vec3(irradiance), glm::vec3(to_light), static_cast<float>(distance)};
}

}  // namespace rcs
