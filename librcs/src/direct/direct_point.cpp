#include "direct/direct_point.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "facts/scene_effects.h"
#include "lamps/polygon.h"
#include "rays/ray_scene_impl.h"
#include "util/color.h"
#include "util/counters.h"

namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

// A highlight makes a lamp at most so many times more important than diffuse reflection by a white surface.
constexpr float kMostHighlight = 4.0f;

}  // namespace

DirectLight::DirectLight(const RayScene& rays, const DirectSettings& options)
    : DirectLight(rays, options, effects_or_scene(options.effects, rays))
{
}

DirectLight::DirectLight(const RayScene& rays, const DirectSettings& options, const EffectSet& effects)
    : rays_(rays),
      options_(options),
      lights_(collect_lights(rays, effects)),
      sky_(effects.has(Effect::environment_peaks) ? environment_of(rays) : black_environment()),
      candidates_(lights_,
                  lights_.triangles.size() <= kTriangleCandidates ? kTriangleCandidates : kTriangleCandidates / 2,
                  false)
{
}

DirectLight::Lobes DirectLight::make_lobes(const Viewer& viewer) const
{
    Lobes lobes;
    if (!viewer.bsdf || glossy_lobes(*viewer.bsdf) == 0u) return lobes;
    lobes.any = true;
    lobes.bsdf = viewer.bsdf;
    // What comes through from behind is found by rays, straight ones or those along the lobe; but punctual lamps by
    // none.
    lobes.reflecting = reflecting_lobes(*lobes.bsdf);
    lobes.seen.emplace(*viewer.bsdf, viewer.outgoing, lobes.reflecting);
    if (options_.gathered && options_.gathered->any()) {
        lobes.lit_by_gathered = lobes.reflecting;
        if (options_.gathered->by_direction) lobes.lit_by_gathered &= ~lobes.bsdf->those(lit_by_records);
        if (options_.gathered->along_lobes) lobes.lit_by_gathered &= ~lobes.bsdf->those(lit_by_rays);
    }
    lobes.lit_behind = lobes_lit_behind(*lobes.bsdf);
    lobes.transmitting = transmitting_lobes(*lobes.bsdf) & ~lobes.lit_behind;
    lobes.outgoing = viewer.outgoing;
    lobes.diffuse = kInversePi * luminance(albedo(*lobes.bsdf, lobes.outgoing, diffuse_lobes(*lobes.bsdf)));
    return lobes;
}

glm::vec3 DirectLight::glossy(const Lobes& lobes, glm::vec3 to_light)
{
    return glossy(*lobes.bsdf, *lobes.seen, to_light);
}

glm::vec3 DirectLight::glossy(const Bsdf& bsdf, const SeenLobes& seen, glm::vec3 to_light)
{
    const float cosine = glm::dot(bsdf.normal, to_light);
    if (!(cosine > 0.0f) || !(glm::dot(bsdf.geometric_normal, to_light) > 0.0f)) return glm::vec3(0.0f);
    return cosine * seen.evaluate(to_light);
}

Lit DirectLight::at(const SurfacePoint& point, const Viewer& viewer, std::uint64_t key, Workspace& w,
                    std::uint64_t mixed, FirstLook* first) const
{
    Lobes lobes = make_lobes(viewer);
    Lit lit = on_this_side(point, lobes, key, w, mixed, first);
    if (lobes.lit_behind == 0u) return lit;
    const LampSight sight = w.sight;
    Lobes none;
    none.is_behind = true;
    const Lit behind = on_this_side(other_side(point), none, mix64(key + 1), w, mixed, nullptr);
    lit.glossy += kInversePi * albedo(*lobes.bsdf, lobes.outgoing, lobes.lit_behind) * behind.irradiance;
    w.sight.free |= sight.free;
    w.sight.hidden |= sight.hidden;
    return lit;
}

bool DirectLight::knows_by_shape() const
{
    // So many have bits of LampSight of their own.
    constexpr std::size_t kMostTriangles = 31;
    return takes_mixed() && lights_.triangles.size() <= kMostTriangles && lights_.punctual.empty() &&
           !sky_.has_peaks() && !rays_.has_transparency() &&
           std::none_of(lights_.triangles.begin(), lights_.triangles.end(),
                        [](const EmissiveTriangle& t) { return t.varied; });
}

std::optional<glm::vec3> DirectLight::irradiance_of_seen(const SurfacePoint& point, const LampSight& sight,
                                                         Workspace& w) const
{
    const Lobes none{};
    RandomStream random(0);  // where lamps are drawn nothing is known by shape
    w.lamps.clear();
    find_lamps(point, none, random, w);
    glm::vec3 irradiance(0.0f);
    for (const LampView& lamp : w.lamps) {
        const std::uint64_t bit = bit_of_lamp(lamp.number);
        if ((sight.seen() & bit) == 0u || (sight.mixed() & bit) != 0u) return std::nullopt;
        if ((sight.free & bit) != 0u) irradiance += lamp.irradiance;
    }
    return irradiance;
}

Lit DirectLight::on_this_side(const SurfacePoint& point, Lobes& lobes, std::uint64_t key, Workspace& w,
                              std::uint64_t mixed, FirstLook* first) const
{
    const bool is_second = first && first->is_over;
    w.sight = {};
    Lit lit = is_second ? first->punctual : punctual(point, lobes, w);
    if (first && !is_second) first->punctual = lit;
    if (lights_.triangles.empty() && !sky_.has_peaks()) return lit;
    RandomStream random(key);
    w.lamps.clear();
    if (!lights_.triangles.empty()) find_lamps(point, lobes, random, w);
    choose_samples(point, w, lobes);
    add_triangles(point, lobes, random, key, mixed, w, first, lit);
    if (sky_.has_peaks()) add_peaks(point, lobes, key, mixed, w, first, lit);
    if (lobes.samples > 0) {
        const Lit more = is_second ? first->along_lobes : along_lobes(point, lobes, key, w);
        lit.irradiance += more.irradiance;
        lit.glossy += more.glossy;
        if (first) first->along_lobes = more;
    }
    if (first) first->is_over = true;
    return lit;
}

Lit DirectLight::punctual(const SurfacePoint& point, const Lobes& lobes, Workspace& w) const
{
    Lit lit;
    for (const PunctualLamp& light : lights_.punctual) {
        const PunctualSample s = sample_punctual(light, point.position);
        const float cosine = glm::dot(point.shading_normal, s.to_light);
        const bool is_behind = cosine <= 0.0f || glm::dot(point.geometric_normal, s.to_light) <= 0.0f;
        if ((is_behind && lobes.transmitting == 0u) || luminance(s.irradiance) <= 0.0f) continue;
        ++w.rays;
        tally(Count::punctual_rays);
        const Ray ray = shadow_ray_from(point, s.to_light, s.distance);
        if (!rays_.has_transparency() && occluded(rays_, ray)) continue;
        const glm::vec3 arriving = rays_.has_transparency() ? s.irradiance * transmittance(rays_, ray) : s.irradiance;
        if (is_behind) {
            lit.glossy +=
                arriving * std::abs(cosine) * evaluate(*lobes.bsdf, lobes.outgoing, s.to_light, lobes.transmitting);
            continue;
        }
        lit.irradiance += cosine * arriving;
        if (lobes.any) lit.glossy += arriving * glossy(lobes, s.to_light);
    }
    return lit;
}

void DirectLight::find_lamps(const SurfacePoint& point, const Lobes& lobes, RandomStream& random, Workspace& w) const
{
    const std::size_t count = candidates_.draw(point.position, point.shading_normal, random.next(), w.candidates);
    for (std::size_t c = 0; c < count; ++c) {
        const LampCandidate& candidate = w.candidates[c];
        const std::uint32_t t = candidate.lamp - static_cast<std::uint32_t>(lights_.punctual.size());
        const EmissiveTriangle& triangle = lights_.triangles[t];
        std::array<glm::vec3, 3> corner;
        for (std::size_t i = 0; i < 3; ++i) corner[i] = triangle.corner[i] - point.position;
        const float behind = glm::dot(triangle.normal, corner[0]);
        if ((behind > 0.0f && !triangle.double_sided) || lies_on_plane(triangle, point)) continue;
        if (is_gathered(triangle, lobes)) continue;
        // Only the part above the horizon: sampling the rest would be in vain.
        glm::vec3 polygon[4];
        const int corners = clip_to_horizon(corner.data(), 3, point.shading_normal, polygon);
        for (int i = 0; i + 2 < corners; ++i) {
            LampView lamp;
            lamp.corner = {polygon[0], polygon[i + 1], polygon[i + 2]};
            lamp.triangle = t;
            lamp.number = 2 * t + static_cast<std::uint32_t>(i);
            lamp.scale = candidate.multiplicity;
            const float factor = polygon_irradiance_factor(lamp.corner.data(), 3, point.shading_normal);
            lamp.irradiance = candidate.multiplicity * factor * triangle.radiance;
            lamp.importance = luminance(lamp.irradiance);
            if (!(factor > 0.0f && lamp.importance > 0.0f)) continue;
            // Highlights of all lamps take as long as the rays that a few picks save.
            if (lobes.any && options_.lamp_picks == 0) {
                const glm::vec3 centre = lamp.corner[0] + lamp.corner[1] + lamp.corner[2];
                const float cosine = glm::dot(lobes.bsdf->normal, glm::normalize(centre));
                const float highlight =
                    cosine > 0.0f ? luminance(glossy(lobes, glm::normalize(centre))) / cosine : 0.0f;
                lamp.importance *= lobes.diffuse + std::min(highlight, kMostHighlight * kInversePi) + 0.01f;
            }
            w.lamps.push_back(lamp);
        }
    }
}

}  // namespace rcs
