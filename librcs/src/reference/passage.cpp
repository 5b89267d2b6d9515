#include "reference/passage.h"

#include <algorithm>
#include <cmath>

#include "rays/packet.h"
#include "rays/surface.h"
#include "rays/surface_material.h"

namespace rcs {

Layer layer_at(const RayScene& rays, const Hit& hit, glm::vec3 direction)
{
    const SurfacePoint point = surface_at(rays, hit.instance, hit.primitive, hit.u, hit.v, direction);
    const Material& material = rays.scene().materials[static_cast<std::size_t>(point.material)];
    if (material.alpha_mode == AlphaMode::opaque && material.transmission == 0.0f) return {};
    const glm::vec3 outgoing = -glm::normalize(direction);
    const MaterialValues values = material_at(rays, hit, point, outgoing, {});
    const glm::vec3 through = albedo(values.bsdf, outgoing, values.bsdf.those(passes_rays));
    return {values.alpha, (1.0f - values.alpha) + values.alpha * through};
}

glm::vec3 transmitted_along(const RayScene& rays, const Ray& ray)
{
    if (!rays.has_transparency()) return glm::vec3(occluded(rays, ray) ? 0.0f : 1.0f);
    glm::vec3 weight(1.0f);
    Ray rest = ray;
    while (const auto hit = intersect(rays, rest, RayFilter::everything)) {
        weight *= layer_at(rays, *hit, ray.direction).transmitted;
        if (weight == glm::vec3(0.0f)) break;
        rest.t_min = std::nextafter(hit->t, rest.t_max);
    }
    return weight;
}

Meeting next_surface(const RayScene& rays, Ray ray, float u)
{
    if (!rays.has_transparency()) return {.hit = intersect(rays, ray)};
    Meeting meeting;
    while ((meeting.hit = intersect(rays, ray, RayFilter::everything))) {
        const Layer layer = layer_at(rays, *meeting.hit, ray.direction);
        const glm::vec3 t = layer.transmitted;
        const float chance = std::max({t.r, t.g, t.b});
        if (u >= chance) {
            meeting.weight *= layer.coverage / (1.0f - chance);
            break;
        }
        meeting.weight *= t / chance;
        u = std::min(u / chance, 0x1.fffffep-1f);
        ray.t_min = std::nextafter(meeting.hit->t, ray.t_max);
    }
    return meeting;
}

}  // namespace rcs
