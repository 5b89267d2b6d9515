#include "direct/direct_point.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "facts/scene_effects.h"
#include "lamps/polygon.h"
#include "rays/ray_scene_impl.h"
#include "util/color.h"
#include "util/counters.h"
#include "util/fraction.h"

namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

// Triangles that together send less than this share of the lamps' light are represented by one shadow ray.
constexpr float kSmallShare = 0.02f;

// A highlight makes a lamp at most so many times more important than diffuse reflection by a white surface.
constexpr float kMostHighlight = 4.0f;

constexpr std::uint64_t bit_of_lamp(std::uint32_t number) { return 1ull << number % 63u; }
constexpr std::uint64_t kBitOfPeaks = 1ull << 63;

/// Point n of the rank-1 lattice of the plastic number (Roberts 2018), shifted.
glm::vec2 lattice(int n, float shift1, float shift2)
{
    return {static_cast<float>(fraction(n * 0.7548776662466927 + static_cast<double>(shift1))),
            static_cast<float>(fraction(n * 0.5698402909980532 + static_cast<double>(shift2)))};
}

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
                    std::uint64_t mixed) const
{
    Lobes lobes = make_lobes(viewer);
    Lit lit = on_this_side(point, lobes, key, w, mixed);
    if (lobes.lit_behind == 0u) return lit;
    const LampSight sight = w.sight;
    Lobes none;
    none.is_behind = true;
    const Lit behind = on_this_side(other_side(point), none, mix64(key + 1), w, mixed);
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
                              std::uint64_t mixed) const
{
    Lit lit;
    w.sight = {};
    add_punctual(point, lobes, w, lit);
    if (lights_.triangles.empty() && !sky_.has_peaks()) return lit;
    RandomStream random(key);
    w.lamps.clear();
    if (!lights_.triangles.empty()) find_lamps(point, lobes, random, w);
    choose_samples(point, w, lobes);
    add_triangles(point, lobes, random, key, mixed, w, lit);
    if (sky_.has_peaks()) add_peaks(point, lobes, key, mixed, w, lit);
    if (lobes.samples > 0) add_lobe_rays(point, lobes, key, w, lit);
    return lit;
}

void DirectLight::add_punctual(const SurfacePoint& point, const Lobes& lobes, Workspace& w, Lit& lit) const
{
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

/// Adds `samples` shadow rays towards the lamp, low-discrepancy over its solid angle, going on where the last call
/// stopped.
void DirectLight::shoot(const SurfacePoint& point, const Lobes& lobes, LampView& lamp, int samples, std::uint64_t key,
                        Workspace& w) const
{
    const EmissiveTriangle& triangle = lights_.triangles[lamp.triangle];
    const SphericalTriangle spherical = make_spherical_triangle(lamp.corner.data());
    const float towards = lobes.samples > 0 ? samples_towards(lamp.triangle, point, lobes) : 0.0f;
    RandomStream random(mix64(key ^ lamp.number));
    const float shift1 = random.next();
    const float shift2 = random.next();
    w.shadow.clear();
    w.weight.clear();
    w.radiance.clear();
    w.glossy.clear();
    for (int i = 0; i < samples; ++i) {
        const glm::vec2 u = lattice(lamp.samples + i, shift1, shift2);
        const TriangleSample s = sample(spherical, u.x, u.y);
        const float distance = glm::length(s.position);
        if (!(distance > 0.0f)) continue;
        const glm::vec3 to_light = s.position / distance;
        const float weight = s.inverse_density * std::max(0.0f, glm::dot(point.shading_normal, to_light));
        if (!(weight > 0.0f)) continue;
        lamp.possible += weight;
        if (glm::dot(point.geometric_normal, to_light) <= 0.0f) continue;
        w.shadow.add(shadow_ray_to(triangle, point, s.position));
        w.weight.push_back(weight);
        const glm::vec3 radiance =
            triangle.varied ? radiance_at(rays_, triangle, point.position + s.position) : triangle.radiance;
        if (triangle.varied) w.radiance.push_back(radiance);
        if (!lobes.any) continue;
        glm::vec3 g = lamp.scale * s.inverse_density * radiance * glossy(lobes, to_light);
        if (lobes.samples > 0) g *= power_heuristic(towards, lobes.counted * lobes.seen->density(to_light));
        w.glossy.push_back(g);
    }
    w.shadow.trace(rays_);
    w.rays += w.shadow.size();
    tally(Count::area_rays, w.shadow.size());
    for (std::size_t i = 0; i < w.shadow.size(); ++i) {
        if (!w.shadow.is_free(i)) continue;
        const glm::vec3 arrives = w.shadow.transmittance(i);
        lamp.free += w.weight[i];
        lamp.seen += static_cast<double>(w.weight[i]) * glm::dvec3(triangle.varied ? arrives * w.radiance[i] : arrives);
        if (lobes.any) lamp.glossy += glm::dvec3(arrives * w.glossy[i]);
    }
    lamp.samples += samples;
}

namespace {

/// Replaces the lamps from `first` on by `picks` of them, drawn in proportion to their importance, evenly over its sum.
void pick(std::size_t first, int picks, RandomStream& random, std::vector<DirectLight::LampView>& lamps)
{
    float rest = 0.0f;
    for (std::size_t k = first; k < lamps.size(); ++k) rest += lamps[k].importance;
    const float step = rest / static_cast<float>(picks);
    float target = random.next() * step;  // from the lamp looked at
    std::size_t kept = first;
    for (std::size_t k = first; k < lamps.size(); ++k) {
        DirectLight::LampView picked = lamps[k];
        const float importance = picked.importance;
        if (target < importance || (k + 1 == lamps.size() && kept == first)) {
            // No lamp here is brighter than a step, so none is picked twice.
            const float factor = step / importance;
            picked.irradiance *= factor;
            picked.scale *= factor;
            picked.importance = step;
            lamps[kept++] = picked;
            target += step;
        }
        target -= importance;
    }
    lamps.resize(kept);
}

/// The dimmest share one pick.
void pick_of_dim_lamps(float total, RandomStream& random, std::vector<DirectLight::LampView>& lamps)
{
    std::size_t own = lamps.size();
    float rest = 0.0f;
    while (own > 0 && rest + lamps[own - 1].importance < kSmallShare * total) rest += lamps[--own].importance;
    if (own < lamps.size()) pick(own, 1, random, lamps);
}

}  // namespace

/// Lamps that outshine what a pick stands for are kept, the others share the picks that are left.
void DirectLight::pick_lamps(float total, RandomStream& random, std::vector<LampView>& lamps) const
{
    int picks = options_.lamp_picks;
    std::size_t own = 0;
    for (float rest = total;
         own < lamps.size() && picks > 1 && lamps[own].importance * static_cast<float>(picks) >= rest; ++own) {
        rest -= lamps[own].importance;
        --picks;
    }
    if (own < lamps.size()) pick(own, picks, random, lamps);
}

/// No noise where a lamp is wholly seen or wholly hidden; more rays where it may be neither. Were that for the point's
/// own few rays to decide, a lamp of which a tenth is seen would often count as hidden.
void DirectLight::add_triangles(const SurfacePoint& point, const Lobes& lobes, RandomStream& random, std::uint64_t key,
                                std::uint64_t mixed, Workspace& w, Lit& lit) const
{
    float total = 0.0f;
    for (const LampView& lamp : w.lamps) total += lamp.importance;
    if (!(total > 0.0f)) return;

    // Bright lamps first; the dim rest shares one sample, picked in proportion to what it would send.
    // Not std::stable_sort(), which allocates.
    std::sort(w.lamps.begin(), w.lamps.end(), [](const LampView& a, const LampView& b) {
        return a.importance > b.importance || (a.importance == b.importance && a.number < b.number);
    });
    if (options_.lamp_picks > 0)
        pick_lamps(total, random, w.lamps);
    else
        pick_of_dim_lamps(total, random, w.lamps);

    for (LampView& lamp : w.lamps) {
        const float share = lamp.importance / total;
        const int picks = options_.lamp_picks;
        const auto count = [&](int samples) {
            return picks > 0 ? (samples + picks - 1) / picks
                             : static_cast<int>(std::ceil(static_cast<float>(samples) * share));
        };
        shoot(point, lobes, lamp, count(options_.area_samples), key, w);
        const bool has_free = lamp.free > 0.0, has_hidden = lamp.free < lamp.possible * (1.0 - 1e-6);
        const std::uint64_t bit = bit_of_lamp(lamp.number);
        w.sight.free |= has_free ? bit : 0u;
        w.sight.hidden |= has_hidden ? bit : 0u;
        if (options_.lamp_picks == 0 && candidates_.draws() ? has_free && has_hidden : (mixed & bit) != 0u)
            shoot(point, lobes, lamp, count(options_.penumbra_samples), key, w);
        // A share of a known sum has next to no noise, but is biased where what it is a share of varies.
        if (lights_.triangles[lamp.triangle].varied)
            lit.irradiance += lamp.scale * glm::vec3(lamp.seen / static_cast<double>(lamp.samples));
        else if (lamp.possible > 0.0)
            lit.irradiance += lamp.irradiance * glm::vec3(lamp.seen / lamp.possible);
        lit.glossy += glm::vec3(lamp.glossy / static_cast<double>(lamp.samples));
    }
}

void DirectLight::add_peaks(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, std::uint64_t mixed,
                            Workspace& w, Lit& lit) const
{
    if (!(sky_.peak_estimate(point.shading_normal) > 0.0f)) return;
    RandomStream random(mix64(key ^ 0xffffffffull << 32));
    const float shift1 = random.next();
    const float shift2 = random.next();
    glm::dvec3 irradiance(0.0), highlight(0.0);
    int samples = 0;
    const auto shoot_peaks = [&](int more) {
        w.shadow.clear();
        w.radiance.clear();
        w.glossy.clear();
        for (int i = samples; i < samples + more; ++i) {
            const Environment::Sample s = sky_.sample_peak(lattice(i, shift1, shift2));
            const float cosine = glm::dot(point.shading_normal, s.direction);
            if (!(s.density > 0.0f) || !(cosine > 0.0f) || !(glm::dot(point.geometric_normal, s.direction) > 0.0f))
                continue;
            w.shadow.add(ray_from(point, s.direction));
            w.radiance.push_back(cosine / s.density * s.radiance);
            if (!lobes.any) continue;
            glm::vec3 g = s.radiance * glossy(lobes, s.direction) / s.density;
            if (lobes.samples > 0) {
                const float towards = static_cast<float>(options_.area_samples) * s.density;
                g *= power_heuristic(towards, lobes.counted * lobes.seen->density(s.direction));
            }
            w.glossy.push_back(g);
        }
        samples += more;
        w.shadow.trace(rays_);
        w.rays += w.shadow.size();
        tally(Count::peak_rays, w.shadow.size());
        std::size_t free = 0;
        for (std::size_t i = 0; i < w.shadow.size(); ++i) {
            if (!w.shadow.is_free(i)) continue;
            ++free;
            irradiance += glm::dvec3(w.shadow.transmittance(i) * w.radiance[i]);
            if (lobes.any) highlight += glm::dvec3(w.shadow.transmittance(i) * w.glossy[i]);
        }
        w.sight.free |= free > 0 ? kBitOfPeaks : 0u;
        w.sight.hidden |= free < w.shadow.size() ? kBitOfPeaks : 0u;
    };
    shoot_peaks(options_.area_samples);
    if ((mixed & kBitOfPeaks) != 0u) shoot_peaks(options_.penumbra_samples);
    lit.irradiance += glm::vec3(irradiance / static_cast<double>(samples));
    lit.glossy += glm::vec3(highlight / static_cast<double>(samples));
}

}  // namespace rcs
