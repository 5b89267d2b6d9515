#include "rcs/direct_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "light/candidates.h"
#include "light/lights.h"
#include "light/polygon.h"
#include "rays/shadow_batch.h"
#include "rcs/error.h"
#include "scene/surface.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Up to this many emissive triangles are all evaluated at each pixel; of more, as many drawn by power.
constexpr std::size_t kTriangleCandidates = 64;

// Triangles that together send less than this share of the lamps' light are represented by one shadow ray.
constexpr float kSmallShare = 0.02f;

// Least shadow rays towards a triangle of its own: two see whether its visibility is mixed.
constexpr int kLeastSamples = 2;

/// One triangle, or the part of one above the horizon, as one pixel sees it.
struct LampView {
    std::array<glm::vec3, 3> corner;  // relative to the point
    std::uint32_t number;             // of its random stream
    glm::vec3 irradiance;  // if nothing stood between, exact (Lambert's formula)
    float luminance;
    int samples = 0;
    double seen = 0.0, possible = 0.0;  // sums of cosine-weighted samples: that arrive, and all
};

struct Workspace {
    std::array<LampCandidate, kTriangleCandidates> candidates;
    std::vector<LampView> lamps;
    ShadowBatch shadow;
    std::vector<float> weight;  // of each shadow ray
    std::uint64_t rays = 0;
};

SurfacePoint surface_of(const GBuffer& g, std::size_t i)
{
    SurfacePoint p{};
    p.position = g.scene_position(i);
    p.position_error = g.position_error[i];
    p.geometric_normal = g.geometric_normal[i];
    p.shading_normal = g.normal(i);
    return p;
}

class DirectLight {
public:
    DirectLight(const RayScene& rays, const DirectOptions& options)
        : rays_(rays), options_(options), lights_(collect_lights(rays)),
          candidates_(lights_, kTriangleCandidates, false)
    {
    }

    glm::vec3 punctual(const SurfacePoint& point, Workspace& w) const;
    glm::vec3 area(const SurfacePoint& point, std::uint64_t key, Workspace& w) const;
    bool has_area() const { return !lights_.triangles.empty(); }

private:
    void find_lamps(const SurfacePoint& point, RandomStream& random, Workspace& w) const;
    void shoot(const SurfacePoint& point, LampView& lamp, int samples, std::uint64_t key, Workspace& w) const;

    const RayScene& rays_;
    DirectOptions options_;
    Lights lights_;
    LampCandidates candidates_;
};

glm::vec3 DirectLight::punctual(const SurfacePoint& point, Workspace& w) const
{
    glm::vec3 sum(0.0f);
    for (const PunctualLamp& light : lights_.punctual) {
        const PunctualSample s = sample_punctual(light, point.position);
        const float cosine = glm::dot(point.shading_normal, s.to_light);
        if (cosine <= 0.0f || glm::dot(point.geometric_normal, s.to_light) <= 0.0f || luminance(s.irradiance) <= 0.0f)
            continue;
        ++w.rays;
        if (!occluded(rays_, shadow_ray_from(point, s.to_light, s.distance)))
            sum += cosine * s.irradiance;
    }
    return sum;
}

void DirectLight::find_lamps(const SurfacePoint& point, RandomStream& random, Workspace& w) const
{
    const std::size_t count = candidates_.draw(random.next(), w.candidates);
    w.lamps.clear();
    for (std::size_t c = 0; c < count; ++c) {
        const LampCandidate& candidate = w.candidates[c];
        const std::uint32_t t = candidate.lamp - static_cast<std::uint32_t>(lights_.punctual.size());
        const EmissiveTriangle& triangle = lights_.triangles[t];
        std::array<glm::vec3, 3> corner;
        for (std::size_t i = 0; i < 3; ++i)
            corner[i] = triangle.corner[i] - point.position;
        if (!triangle.double_sided && glm::dot(triangle.normal, corner[0]) >= 0.0f)
            continue;
        // Only the part above the horizon: sampling the rest would be in vain.
        glm::vec3 polygon[4];
        const int corners = clip_to_horizon(corner.data(), 3, point.shading_normal, polygon);
        for (int i = 0; i + 2 < corners; ++i) {
            const std::array<glm::vec3, 3> part{polygon[0], polygon[i + 1], polygon[i + 2]};
            const float factor = polygon_irradiance_factor(part.data(), 3, point.shading_normal);
            const glm::vec3 irradiance = candidate.multiplicity * factor * triangle.radiance;
            if (factor > 0.0f && luminance(irradiance) > 0.0f)
                w.lamps.push_back({part, 2 * t + static_cast<std::uint32_t>(i), irradiance, luminance(irradiance)});
        }
    }
}

/// Adds `samples` shadow rays towards the lamp, low-discrepancy over its solid angle.
void DirectLight::shoot(const SurfacePoint& point, LampView& lamp, int samples, std::uint64_t key, Workspace& w) const
{
    const SphericalTriangle spherical = make_spherical_triangle(lamp.corner.data());
    RandomStream random(mix64(key ^ lamp.number));
    const float shift1 = random.next();
    const float shift2 = random.next();
    w.shadow.clear();
    w.weight.clear();
    for (int i = 0; i < samples; ++i) {
        // Rank-1 lattice of the plastic number (Roberts 2018), shifted at random, going on where the last call stopped.
        const double n = lamp.samples + i;
        const double u1 = std::fmod(n * 0.7548776662466927 + static_cast<double>(shift1), 1.0);
        const double u2 = std::fmod(n * 0.5698402909980532 + static_cast<double>(shift2), 1.0);
        const TriangleSample s = sample(spherical, static_cast<float>(u1), static_cast<float>(u2));
        const float distance = glm::length(s.position);
        if (!(distance > 0.0f))
            continue;
        const glm::vec3 to_light = s.position / distance;
        const float weight = s.inverse_density * std::max(0.0f, glm::dot(point.shading_normal, to_light));
        if (!(weight > 0.0f))
            continue;
        lamp.possible += weight;
        if (glm::dot(point.geometric_normal, to_light) <= 0.0f)
            continue;
        w.shadow.add(shadow_ray_from(point, to_light, distance));
        w.weight.push_back(weight);
    }
    w.shadow.trace(rays_);
    w.rays += w.shadow.size();
    for (std::size_t i = 0; i < w.shadow.size(); ++i)
        if (w.shadow.is_free(i))
            lamp.seen += w.weight[i];
    lamp.samples += samples;
}

/// Exact unoccluded irradiance of every triangle times the share of it that shadow rays find free: no noise
/// where a lamp is wholly seen or wholly hidden; more rays where it is neither.
glm::vec3 DirectLight::area(const SurfacePoint& point, std::uint64_t key, Workspace& w) const
{
    RandomStream random(key);
    find_lamps(point, random, w);
    float total = 0.0f;
    for (const LampView& lamp : w.lamps)
        total += lamp.luminance;
    if (!(total > 0.0f))
        return glm::vec3(0.0f);

    // Bright lamps first; the dim rest shares one sample, picked in proportion to what it would send.
    std::stable_sort(w.lamps.begin(), w.lamps.end(),
                     [](const LampView& a, const LampView& b) { return a.luminance > b.luminance; });
    std::size_t own = w.lamps.size();
    float rest = 0.0f;
    while (own > 0 && rest + w.lamps[own - 1].luminance < kSmallShare * total)
        rest += w.lamps[--own].luminance;
    if (own < w.lamps.size()) {
        float target = random.next() * rest;
        std::size_t chosen = own;
        while (chosen + 1 < w.lamps.size() && (target -= w.lamps[chosen].luminance) >= 0.0f)
            ++chosen;
        LampView picked = w.lamps[chosen];
        picked.irradiance *= rest / picked.luminance;
        picked.luminance = rest;
        w.lamps.resize(own);
        w.lamps.push_back(picked);
    }

    glm::vec3 sum(0.0f);
    for (LampView& lamp : w.lamps) {
        const float share = lamp.luminance / total;
        const auto count = [&](int samples) { return static_cast<int>(std::ceil(static_cast<float>(samples) * share)); };
        shoot(point, lamp, std::max(kLeastSamples, count(options_.area_samples)), key, w);
        if (lamp.seen > 0.0 && lamp.seen < lamp.possible * (1.0 - 1e-6))
            shoot(point, lamp, count(options_.penumbra_samples), key, w);
        if (lamp.possible > 0.0)
            sum += lamp.irradiance * static_cast<float>(lamp.seen / lamp.possible);
    }
    return sum;
}

}  // namespace

void validate(const DirectOptions& o)
{
    if (o.area_samples < 1 || o.area_samples > 1024)
        throw Error(ErrorCode::bad_argument, "direct.area_samples is " + std::to_string(o.area_samples) +
                                                 ", expected a value in [1, 1024]");
    if (o.penumbra_samples < o.area_samples || o.penumbra_samples > 65536)
        throw Error(ErrorCode::bad_argument, "direct.penumbra_samples is " + std::to_string(o.penumbra_samples) +
                                                 ", expected a value in [area_samples, 65536]");
}

std::vector<glm::vec3> direct_irradiance(const RayScene& rays, const GBuffer& gbuffer, const DirectOptions& options,
                                         ThreadPool& pool, std::uint64_t& shadow_rays)
{
    validate(options);
    const DirectLight light(rays, options);
    std::vector<glm::vec3> irradiance(gbuffer.size(), glm::vec3(0.0f));
    std::vector<Workspace> workspaces(static_cast<std::size_t>(pool.size()));
    pool.parallel_for(gbuffer.size(), 1024, [&](std::size_t begin, std::size_t end, int thread) {
        Workspace& w = workspaces[static_cast<std::size_t>(thread)];
        for (std::size_t i = begin; i < end; ++i) {
            if (!gbuffer.covered(i))
                continue;
            const SurfacePoint point = surface_of(gbuffer, i);
            irradiance[i] = light.punctual(point, w);
            if (light.has_area())
                irradiance[i] += light.area(point, stream_key(options.seed, Stream::direct, i), w);
        }
    });
    for (const Workspace& w : workspaces)
        shadow_rays += w.rays;
    return irradiance;
}

}  // namespace rcs
