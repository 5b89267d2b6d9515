#include "light/hit_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "light/polygon.h"
#include "util/color.h"

namespace rcs {
namespace {

// Up to this many lamps are all estimated at each hit; of more, as many candidates are drawn by power.
constexpr std::size_t kCandidates = 32;

// Nearer than this many times its own size a triangle is sampled by solid angle, farther away by area:
// there the two differ by less than a tenth.
constexpr float kFarInSizes2 = 10.0f;

/// Light that comes from the front of both the face and the shading normal.
float cosine_if_lit(const SurfacePoint& point, glm::vec3 to_light)
{
    const float cosine = glm::dot(point.shading_normal, to_light);
    return glm::dot(point.geometric_normal, to_light) > 0.0f ? std::max(cosine, 0.0f) : 0.0f;
}

}  // namespace

HitLights::HitLights(const Lights& lights) : lights_(lights), candidates_(lights, kCandidates, true),
      any_(!lights.punctual.empty() || !lights.triangles.empty())
{
    if (lights.punctual.size() == 1 && lights.triangles.empty() && lights.punctual[0].kind == LightKind::directional)
        only_direction_ = glm::vec3(-lights.punctual[0].direction);
    for (const EmissiveTriangle& t : lights_.triangles) {
        const glm::vec3 centre = (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f;
        float radius = 0.0f;
        for (const glm::vec3& corner : t.corner)
            radius = std::max(radius, glm::distance(centre, corner));
        bounding_spheres_.emplace_back(centre, radius);
    }
}

float HitLights::estimate(std::uint32_t light, const SurfacePoint& point) const
{
    if (light < lights_.punctual.size()) {
        const PunctualSample s = sample_punctual(lights_.punctual[light], point.position);
        return luminance(s.irradiance) * cosine_if_lit(point, s.to_light);
    }
    const std::size_t t = light - lights_.punctual.size();
    const EmissiveTriangle& triangle = lights_.triangles[t];
    const glm::vec4 sphere = bounding_spheres_[t];
    const glm::vec3 to_centre = glm::vec3(sphere) - point.position;
    const float distance = glm::length(to_centre);
    // Cosines of the most favourable point of the bounding sphere: never 0 where light can arrive.
    const float facing = triangle.double_sided ? 1.0f : (sphere.w - glm::dot(triangle.normal, to_centre)) / distance;
    const float seen = (sphere.w + glm::dot(point.shading_normal, to_centre)) / distance;
    if (facing <= 0.0f || seen <= 0.0f)
        return 0.0f;
    const float nearest2 = std::max(distance * distance, 0.25f * triangle.area);
    return luminance(triangle.radiance) * triangle.area * std::min(facing, 1.0f) * std::min(seen, 1.0f) / nearest2;
}

HitLights::Sample HitLights::sample_triangle(const EmissiveTriangle& triangle, const SurfacePoint& point,
                                             RandomStream& random) const
{
    glm::vec3 corners[3];
    for (int i = 0; i < 3; ++i)
        corners[i] = triangle.corner[i] - point.position;
    const float u1 = random.next();
    const float u2 = random.next();
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
    result.distance = glm::length(s.position);
    if (!(result.distance > 0.0f))
        return result;
    result.to_light = s.position / result.distance;
    const bool front = glm::dot(triangle.normal, result.to_light) < 0.0f;
    if (front || triangle.double_sided)
        result.irradiance = triangle.radiance * s.inverse_density * cosine_if_lit(point, result.to_light);
    return result;
}

HitLights::Sample HitLights::sample_lamp(std::uint32_t lamp, const SurfacePoint& point, RandomStream& random) const
{
    if (lamp >= lights_.punctual.size())
        return sample_triangle(lights_.triangles[lamp - lights_.punctual.size()], point, random);
    const PunctualSample s = sample_punctual(lights_.punctual[lamp], point.position);
    return {s.irradiance * cosine_if_lit(point, s.to_light), s.to_light, s.distance};
}

HitLights::Sample HitLights::sample(const SurfacePoint& point, RandomStream& random) const
{
    if (lights_.punctual.size() + lights_.triangles.size() == 1)
        return sample_lamp(0, point, random);
    std::array<LampCandidate, kCandidates> candidates;
    std::array<float, kCandidates> estimates;
    const std::size_t count = candidates_.draw(candidates_.draws() ? random.next() : 0.0f, candidates);
    float sum = 0.0f;
    for (std::size_t i = 0; i < count; ++i)
        sum += estimates[i] = candidates[i].multiplicity * estimate(candidates[i].lamp, point);
    if (!(sum > 0.0f))
        return {};
    std::size_t chosen = 0;
    float rest = random.next() * sum;
    for (std::size_t i = 0; i < count; ++i) {
        if (estimates[i] <= 0.0f)
            continue;
        chosen = i;
        rest -= estimates[i];
        if (rest < 0.0f)
            break;
    }
    Sample result = sample_lamp(candidates[chosen].lamp, point, random);
    result.irradiance *= candidates[chosen].multiplicity * sum / estimates[chosen];
    return result;
}

}  // namespace rcs
