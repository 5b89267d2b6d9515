#include "light/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/surface.h"

namespace rcs {
namespace {

/// Appends the mesh's triangles that have area. Which side is the front is asked of surface_at(), so
/// that lamps and rays agree also on mirrored instances.
void append_emissive_triangles(const RayScene& rays, std::uint32_t instance, const Mesh& mesh,
                               const Material& material, std::vector<EmissiveTriangle>& triangles)
{
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
        if (!surface_at(rays, instance, primitive, kThird, kThird, -triangle.normal).front)
            triangle.normal = -triangle.normal;
        triangle.radiance = material.emission;
        triangle.double_sided = material.double_sided;
        triangles.push_back(triangle);
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

Lights collect_lights(const RayScene& rays)
{
    const Scene& scene = rays.scene();
    Lights lights;
    lights.punctual.assign(scene.lights.begin(), scene.lights.end());
    lights.sky_radiance = scene.sky_radiance;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[i].mesh)];
        const Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
        if (material.emission != glm::vec3(0.0f))
            append_emissive_triangles(rays, i, mesh, material, lights.triangles);
    }
    return lights;
}

PunctualLamp::PunctualLamp(const PunctualLight& light)
    : PunctualLight(light), cos_inner(std::cos(static_cast<double>(light.inner_cone))),
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
    if (light.kind == LightKind::spot)
        strength *= cone_attenuation(light, -glm::dot(to_light, light.direction));
    // A lamp on the surface itself must not overflow what is summed later.
    constexpr double kMaxIrradiance = 1e30;
    const glm::dvec3 irradiance = glm::min(glm::dvec3(light.intensity) * strength, kMaxIrradiance);
    return {glm::vec3(irradiance), glm::vec3(to_light), static_cast<float>(distance)};
}

}  // namespace rcs
