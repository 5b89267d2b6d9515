#include "reference/path_tracer.h"

#include <cmath>
#include <numbers>


namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

// What each pair of a path's points is for: a lamp and a direction at each of its points.
constexpr int lamp_pair(int bounce) { return kPixelPair + 1 + 2 * bounce; }
constexpr int direction_pair(int bounce) { return kPixelPair + 2 + 2 * bounce; }

/// Direction with density cos / pi about the normal (Malley's method), in the orthonormal basis of
/// Duff et al. 2017, "Building an orthonormal basis, revisited".
glm::vec3 cosine_direction(glm::vec3 n, glm::vec2 u)
{
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    const glm::vec3 tangent(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
    const glm::vec3 bitangent(b, sign + n.y * n.y * a, -n.y);
    const float radius = std::sqrt(u.x);
    const float phi = 2.0f * std::numbers::pi_v<float> * u.y;
    return (radius * std::cos(phi)) * tangent + (radius * std::sin(phi)) * bitangent +
           std::sqrt(1.0f - u.x) * n;
}

}  // namespace

PathTracer::PathTracer(const RayScene& rays, const View& view, const ReferenceOptions& options)
    : rays_(rays),
      view_(view),
      camera_position_(camera_position(view.camera)),
      texture_scale_(1.0f / std::sqrt(static_cast<float>(options.aa))),
      bounces_(options.bounces),
      lights_(collect_lights(rays)),
      has_sky_(lights_.sky_radiance != glm::vec3(0.0f))
{
}

void PathTracer::look(double x, double y, Lamps which, Seen& seen) const
{
    seen.exact_irradiance = glm::vec3(0.0f);
    seen.point = see(camera_ray(view_, x, y));
    if (!seen.point) return;
    weigh_lamps(lights_, seen.point->surface, which, seen.lamps);
    if (which == Lamps::with_area)
        seen.exact_irradiance = punctual_irradiance(rays_, lights_, seen.point->surface);
}

PathResult PathTracer::trace(const Seen& seen, const PathPoints& points, LampsAtPoint& scratch) const
{
    if (!seen.point) return {.emission = lights_.sky_radiance};
    const VisiblePoint& visible = *seen.point;
    const glm::vec3 sampled = sample_lamp(rays_, lights_, visible.surface, seen.lamps, points, lamp_pair(0));
    return {.emission = visible.emission,
            .direct = visible.albedo * kInversePi * (seen.exact_irradiance + sampled),
            .indirect = visible.albedo * gathered_radiance(visible.surface, points, scratch)};
}

std::optional<VisiblePoint> PathTracer::see(const CameraRay& camera) const
{
    const std::optional<Hit> hit = find_visible(rays_, camera);
    if (!hit) return std::nullopt;
    return visible_point(rays_, hit->instance, hit->primitive, camera, camera_position_, texture_scale_);
}

/// One-path estimate of E / pi from all but the lamps. Directions are cosine distributed: each one's
/// radiance counts as it is.
glm::vec3 PathTracer::gathered_radiance(SurfacePoint point, const PathPoints& points,
                                        LampsAtPoint& lamps) const
{
    glm::vec3 radiance(0.0f);
    glm::vec3 throughput(1.0f);
    for (int bounce = 0;; ++bounce) {
        const bool only_sky_counts = bounce == bounces_;
        if (only_sky_counts && !has_sky_) return radiance;
        const glm::vec2 u = points.pair(direction_pair(bounce));
        const glm::vec3 direction = cosine_direction(point.shading_normal, u);
        if (receiving_cosine(point, direction) <= 0.0f) return radiance;

        const Ray ray = ray_from(point, direction);
        const glm::vec3 with_sky = radiance + throughput * lights_.sky_radiance;
        if (only_sky_counts) return occluded(rays_, ray) ? radiance : with_sky;
        const auto hit = intersect(rays_, ray);
        if (!hit) return with_sky;

        point = surface_at(rays_, hit->instance, hit->primitive, hit->u, hit->v, direction);
        weigh_lamps(lights_, point, Lamps::all, lamps);
        const glm::vec3 irradiance = sample_lamp(rays_, lights_, point, lamps, points, lamp_pair(bounce + 1));
        // A texel costs as much as a short ray, and most points at the end of a path lie in shadow.
        const bool ends_here = bounce + 1 == bounces_ && !has_sky_;
        if (ends_here && irradiance == glm::vec3(0.0f)) return radiance;
        throughput *= material_at(rays_, *hit, point, -direction, {}).bsdf.diffuse;
        if (throughput == glm::vec3(0.0f)) return radiance;
        radiance += throughput * kInversePi * irradiance;
    }
}

}  // namespace rcs
