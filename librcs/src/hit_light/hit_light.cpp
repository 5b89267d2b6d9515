#include "hit_light/hit_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "lamps/polygon.h"
#include "scene/environment.h"
#include "util/color.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

// Up to this many lamps are all estimated at each hit; of more, as many candidates are drawn.
constexpr std::size_t kCandidates = 32;

// Candidates drawn from a tree know the point already: fewer do.
constexpr std::size_t kTreeCandidates = 4;

// Nearer than this many times its own size a triangle is sampled by solid angle, farther away by area:
// there the two differ by less than a tenth.
constexpr float kFarInSizes2 = 10.0f;

// Smaller is no solid angle in float arithmetic.
constexpr float kLeastSolidAngle = 1e-12f;

/// Light that comes from the front of both the face and the shading normal.
float cosine_if_lit(const SurfacePoint& point, glm::vec3 to_light)
{
    const float cosine = glm::dot(point.shading_normal, to_light);
    return glm::dot(point.geometric_normal, to_light) > 0.0f ? std::max(cosine, 0.0f) : 0.0f;
}

}  // namespace

HitLights::HitLights(const Lights& lights)
    : lights_(lights),
      candidates_(lights_,
                  lights_.punctual.size() + lights_.triangles.size() <= kCandidates ? kCandidates : kTreeCandidates,
                  true),
      any_(!lights_.punctual.empty() || !lights_.triangles.empty() || lights_.has_peaks())
{
    for (const PunctualLamp& lamp : lights_.punctual) add(lamp);
    for (const EmissiveTriangle& triangle : lights_.triangles) add(triangle);
    if (lights_.punctual.size() == 1 && lights_.triangles.empty() && !lights_.has_peaks() &&
        lights_.punctual[0].kind == LightKind::directional)
        only_direction_ = glm::vec3(-lights_.punctual[0].direction);
}

void HitLights::add(const PunctualLamp& lamp)
{
    const bool sun = lamp.kind == LightKind::directional;
    const bool spot = lamp.kind == LightKind::spot;
    const glm::vec3 at(sun ? -lamp.direction : lamp.position);
    punctual_.luminance.push_back(luminance(lamp.intensity));
    punctual_.x.push_back(at.x);
    punctual_.y.push_back(at.y);
    punctual_.z.push_back(at.z);
    punctual_.axis_x.push_back(static_cast<float>(lamp.direction.x));
    punctual_.axis_y.push_back(static_cast<float>(lamp.direction.y));
    punctual_.axis_z.push_back(static_cast<float>(lamp.direction.z));
    punctual_.inverse_range.push_back(sun ? 0.0f : 1.0f / lamp.range);
    // A little wider than the cone: rounding must not make impossible what can happen.
    punctual_.cos_outer.push_back(spot ? static_cast<float>(lamp.cos_outer - 1e-5) : -2.0f);
    punctual_.inverse_cone.push_back(spot ? static_cast<float>(1.0 / std::max(0.001, lamp.cos_inner - lamp.cos_outer))
                                          : 1.0f);
    punctual_.is_sun.push_back(sun ? 1.0f : 0.0f);
}

void HitLights::add(const EmissiveTriangle& triangle)
{
    const glm::vec3 centre = (triangle.corner[0] + triangle.corner[1] + triangle.corner[2]) / 3.0f;
    float radius = 0.0f;
    for (const glm::vec3& corner : triangle.corner) radius = std::max(radius, glm::distance(centre, corner));
    triangles_.power.push_back(luminance(triangle.radiance) * triangle.area);
    triangles_.x.push_back(centre.x);
    triangles_.y.push_back(centre.y);
    triangles_.z.push_back(centre.z);
    triangles_.radius.push_back(radius);
    triangles_.normal_x.push_back(triangle.normal.x);
    triangles_.normal_y.push_back(triangle.normal.y);
    triangles_.normal_z.push_back(triangle.normal.z);
    triangles_.area.push_back(triangle.area);
    triangles_.two_sided.push_back(triangle.double_sided ? 1.0f : 0.0f);
}

RCS_ALWAYS_INLINE float HitLights::estimate_punctual(std::size_t i, glm::vec3 p, glm::vec3 n) const
{
    const PunctualEstimates& l = punctual_;
    const float sun = l.is_sun[i], here = 1.0f - sun;
    const float dx = l.x[i] - here * p.x, dy = l.y[i] - here * p.y, dz = l.z[i] - here * p.z;
    const float d2 = dx * dx + dy * dy + dz * dz + 1e-30f;
    const float inverse_d = 1.0f / std::sqrt(d2);
    const float cosine = (dx * n.x + dy * n.y + dz * n.z) * inverse_d;
    const float ratio2 = d2 * l.inverse_range[i] * l.inverse_range[i];
    const float range = 1.0f - ratio2 * ratio2;
    const float along = -(dx * l.axis_x[i] + dy * l.axis_y[i] + dz * l.axis_z[i]) * inverse_d;
    const float raw_edge = (along - l.cos_outer[i]) * l.inverse_cone[i];
    const float edge = raw_edge < 0.0f ? 0.0f : raw_edge > 1.0f ? 1.0f : raw_edge;
    const float falloff = sun + here * inverse_d * inverse_d;
    const float e = l.luminance[i] * falloff * edge * edge * range * cosine;
    return cosine > 0.0f && range > 0.0f ? e : 0.0f;
}

/// Cosines are those of the most favourable point of the bounding sphere: never 0 where light can arrive.
RCS_ALWAYS_INLINE float HitLights::estimate_triangle(std::size_t i, glm::vec3 p, glm::vec3 n) const
{
    const TriangleEstimates& t = triangles_;
    const float dx = t.x[i] - p.x, dy = t.y[i] - p.y, dz = t.z[i] - p.z;
    const float d2 = dx * dx + dy * dy + dz * dz + 1e-30f;
    const float inverse_d = 1.0f / std::sqrt(d2);
    const float away = dx * t.normal_x[i] + dy * t.normal_y[i] + dz * t.normal_z[i];
    float facing = (t.radius[i] - away) * inverse_d;
    const bool is_all = (t.two_sided[i] > 0.0f) | (facing > 1.0f);
    facing = is_all ? 1.0f : facing;
    float seen = (t.radius[i] + dx * n.x + dy * n.y + dz * n.z) * inverse_d;
    seen = seen > 1.0f ? 1.0f : seen;
    const float nearest2 = d2 > 0.25f * t.area[i] ? d2 : 0.25f * t.area[i];
    // A load behind a condition would keep the loop from becoming vectors.
    const float sent = t.power[i] * facing * seen / nearest2;
    return facing > 0.0f && seen > 0.0f ? sent : 0.0f;
}

float HitLights::estimate(std::uint32_t lamp, const SurfacePoint& point) const
{
    const std::size_t punctual = lights_.punctual.size();
    return lamp < punctual ? estimate_punctual(lamp, point.position, point.shading_normal)
                           : estimate_triangle(lamp - punctual, point.position, point.shading_normal);
}

RCS_MULTIVERSION
void HitLights::estimate_all(const SurfacePoint& point, float* estimates) const
{
    const glm::vec3 p = point.position, n = point.shading_normal;
    const std::size_t punctual = lights_.punctual.size(), triangles = lights_.triangles.size();
    RCS_INDEPENDENT_LOOP
    for (std::size_t i = 0; i < punctual; ++i) estimates[i] = estimate_punctual(i, p, n);
    RCS_INDEPENDENT_LOOP
    for (std::size_t i = 0; i < triangles; ++i) estimates[punctual + i] = estimate_triangle(i, p, n);
}

HitLights::Sample HitLights::sample_triangle(const EmissiveTriangle& triangle, const SurfacePoint& point,
                                             RandomStream& random) const
{
    glm::vec3 corners[3];
    for (int i = 0; i < 3; ++i) corners[i] = triangle.corner[i] - point.position;
    const float u1 = random.next();
    const float u2 = random.next();
    if (lies_on_plane(triangle, point)) return {};
    TriangleSample s;
    const glm::vec3 centre = (corners[0] + corners[1] + corners[2]) / 3.0f;
    if (glm::dot(centre, centre) > kFarInSizes2 * triangle.area) {
        const float root = std::sqrt(u1);
        s.position = (1.0f - root) * corners[0] + root * (1.0f - u2) * corners[1] + root * u2 * corners[2];
        const float d2 = glm::dot(s.position, s.position);
        s.inverse_density = triangle.area * std::abs(glm::dot(triangle.normal, s.position)) / (d2 * std::sqrt(d2));
    } else {
        s = rcs::sample(make_spherical_triangle(corners), u1, u2);
    }
    Sample result;
    const float distance = glm::length(s.position);
    if (!(distance > 0.0f)) return result;
    result.to_light = s.position / distance;
    const bool front = glm::dot(triangle.normal, result.to_light) < 0.0f;
    if (!front && !triangle.double_sided) return result;
    result.irradiance = s.inverse_density * cosine_if_lit(point, result.to_light) *
                        radiance_at(*lights_.rays, triangle, point.position + s.position);
    result.shadow_ray = shadow_ray_to(triangle, point, s.position);
    return result;
}

HitLights::Sample HitLights::sample_peaks(const SurfacePoint& point, RandomStream& random) const
{
    const float u = random.next();
    const Environment::Sample s = lights_.sky->sample_peak({u, random.next()});
    if (!(s.density > 0.0f)) return {};
    return {s.radiance * (cosine_if_lit(point, s.direction) / s.density), s.direction, ray_from(point, s.direction),
            peaks_lamp()};
}

HitLights::Sample HitLights::sample_lamp(std::uint32_t lamp, const SurfacePoint& point, RandomStream& random) const
{
    if (lamp >= lights_.punctual.size()) {
        Sample result = sample_triangle(lights_.triangles[lamp - lights_.punctual.size()], point, random);
        result.lamp = lamp;
        return result;
    }
    const PunctualSample s = sample_punctual(lights_.punctual[lamp], point.position);
    return {s.irradiance * cosine_if_lit(point, s.to_light), s.to_light, shadow_ray_from(point, s.to_light, s.distance),
            lamp};
}

float HitLights::density(const SurfacePoint& point, std::uint32_t lamp, glm::vec3 direction) const
{
    const std::size_t punctual = lights_.punctual.size();
    if (lamp < punctual) return 0.0f;
    if (lamp == peaks_lamp()) return lights_.sky->peak_density(direction);
    const std::uint32_t index = lamp - static_cast<std::uint32_t>(punctual);
    const float total = lights_.tree->estimate(point.position, point.shading_normal, LightTree::kMostParts);
    const float estimate = lights_.tree->estimate(index, point.position, point.shading_normal);
    const EmissiveTriangle& t = lights_.triangles[index];
    const glm::vec3 corners[3] = {t.corner[0] - point.position, t.corner[1] - point.position,
                                  t.corner[2] - point.position};
    const float solid_angle =
        std::max(static_cast<float>(make_spherical_triangle(corners).solid_angle), kLeastSolidAngle);
    return total > 0.0f ? std::min(estimate / total, 1.0f) / solid_angle : 0.0f;
}

HitLights::Sample HitLights::sample(const SurfacePoint& point, RandomStream& random) const
{
    const bool has_peaks = lights_.has_peaks();
    const std::size_t lamps = lights_.punctual.size() + lights_.triangles.size();
    if (lamps == 0) return has_peaks ? sample_peaks(point, random) : Sample{};
    if (lamps == 1 && !has_peaks) return sample_lamp(0, point, random);
    std::array<LampCandidate, kCandidates + 1> candidates;
    std::array<float, kCandidates + 1> estimates;
    std::size_t count =
        candidates_.draw(point.position, point.shading_normal, candidates_.draws() ? random.next() : 0.0f,
                         std::span(candidates).first(kCandidates));
    if (candidates_.draws()) {
        for (std::size_t i = 0; i < count; ++i)
            estimates[i] = candidates[i].multiplicity * estimate(candidates[i].lamp, point);
    } else {
        estimate_all(point, estimates.data());
    }
    const std::uint32_t peaks = peaks_lamp();
    if (has_peaks) {
        estimates[count] = lights_.sky->peak_estimate(point.shading_normal);
        candidates[count++] = {peaks, 1.0f};
    }
    float sum = 0.0f;
    for (std::size_t i = 0; i < count; ++i) sum += estimates[i];
    if (!(sum > 0.0f)) return {};
    std::size_t chosen = 0;
    float rest = random.next() * sum;
    for (std::size_t i = 0; i < count; ++i) {
        if (estimates[i] <= 0.0f) continue;
        chosen = i;
        rest -= estimates[i];
        if (rest < 0.0f) break;
    }
    Sample result = candidates[chosen].lamp == peaks ? sample_peaks(point, random)
                                                     : sample_lamp(candidates[chosen].lamp, point, random);
    result.irradiance *= candidates[chosen].multiplicity * sum / estimates[chosen];
    return result;
}

}  // namespace rcs
