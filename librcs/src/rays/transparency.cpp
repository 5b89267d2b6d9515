#include "rays/transparency.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "material/bsdf.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "rays/surface_material.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

const Material& material_of(const RayScene& rays, std::uint32_t instance)
{
    return rays.scene().materials[static_cast<std::size_t>(rays.impl().instances[instance].material)];
}

float coverage_at(const RayScene& rays, const Hit& hit)
{
    return alpha_at(rays.scene(), *rays.impl().instances[hit.instance].mesh, hit.primitive, hit.u, hit.v);
}

/// In [0, 1), from the bits of ray and triangle.
float chance(const Meeting& m)
{
    const auto pair = [](float a, float b) {
        return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(a)) << 32 | std::bit_cast<std::uint32_t>(b);
    };
    std::uint64_t key = mix64(pair(m.direction.x, m.direction.y));
    key = mix64(key ^ pair(m.direction.z, m.origin.x));
    key = mix64(key ^ pair(m.origin.y, m.origin.z));
    key = mix64(key ^ (static_cast<std::uint64_t>(m.hit.instance) << 32 | m.hit.primitive));
    return to_unit_float(static_cast<std::uint32_t>(key >> 32));
}

/// @return whether there was room
bool note(Passage& passage, const Meeting& m, glm::vec3 weight)
{
    int& count = passage.count[m.lane];
    Passage::Crossing* list = passage.crossings[m.lane];
    const auto is_same = [&](const Passage::Crossing& c) {
        return c.instance == m.hit.instance && c.primitive == m.hit.primitive;
    };
    if (std::any_of(list, list + count, is_same)) return true;
    if (count == Passage::kMost) return false;
    list[count++] = {m.hit.t, m.hit.instance, m.hit.primitive, weight};
    return true;
}

}  // namespace

Veil veil_at(const RayScene& rays, const Hit& hit, glm::vec3 direction)
{
    Veil veil;
    if (!(material_of(rays, hit.instance).transmission > 0.0f)) {
        veil.coverage = coverage_at(rays, hit);
        veil.transmittance = glm::vec3(1.0f - veil.coverage);
        return veil;
    }
    const SurfacePoint point = surface_at(rays, hit.instance, hit.primitive, hit.u, hit.v, direction);
    const glm::vec3 to_viewer = -glm::normalize(direction);
    const MaterialValues values = material_at(rays, hit, point, to_viewer, {});
    const glm::vec3 through = glm::clamp(albedo(values.bsdf, to_viewer, values.bsdf.those(passes_rays)), 0.0f, 1.0f);
    veil.coverage = values.alpha;
    veil.transmittance = (1.0f - values.alpha) + values.alpha * through;
    return veil;
}

bool goes_on(Passage& passage, const Meeting& m)
{
    if (material_of(passage.rays, m.hit.instance).alpha_mode == AlphaMode::mask &&
        coverage_at(passage.rays, m.hit) <= 0.0f)
        return true;
    if (passage.rule == Passage::Rule::everything) return false;
    const RayInstance& instance = passage.rays.impl().instances[m.hit.instance];
    const glm::vec3 direction = m.is_instanced ? glm::mat3(instance.scene_from_object) * m.direction : m.direction;
    const glm::vec3 t = veil_at(passage.rays, m.hit, direction).transmittance;
    const float p = largest(t);
    if (!(p > 0.0f)) return false;
    if (passage.rule == Passage::Rule::weighted && note(passage, m, t)) return true;
    if (chance(m) >= p) return false;
    const glm::vec3 tint = t / p;
    if (tint != glm::vec3(1.0f)) note(passage, m, tint);
    return true;
}

glm::vec3 product(const Passage& passage, std::uint32_t lane)
{
    glm::vec3 result(1.0f);
    const Passage::Crossing* list = passage.crossings[lane];
    for (int i = 0; i < passage.count[lane]; ++i) result *= list[i].weight;
    return result;
}

glm::vec3 weight_of(const Passage& passage, std::uint32_t lane, const Hit* hit, glm::vec3 direction)
{
    glm::vec3 result(1.0f);
    const float end = hit ? hit->t : std::numeric_limits<float>::infinity();
    const Passage::Crossing* list = passage.crossings[lane];
    for (int i = 0; i < passage.count[lane]; ++i)
        if (list[i].t < end) result *= list[i].weight;
    if (!hit || !(material_of(passage.rays, hit->instance).transmission > 0.0f)) return result;
    // A blended surface stops rays by its coverage, which is also its share of the light: 1. A transmitting one
    // stops fewer than it reflects light from.
    const Veil veil = veil_at(passage.rays, *hit, direction);
    const float stops = 1.0f - largest(veil.transmittance);
    return stops > 0.0f ? result * (veil.coverage / stops) : result;
}

}  // namespace rcs
