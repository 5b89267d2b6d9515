#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "direct/direct_point.h"
#include "lamps/polygon.h"
#include "util/counters.h"
#include "util/fraction.h"

namespace rcs {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Rays along a lobe narrower than the lamps; fewer where all of them meet much the same.
constexpr int kLobeSamples = 16;
constexpr int kMirrorSamples = 8;

// A ray along a narrow lobe is worth more than a lamp's sample of the same density: what it finds is the lobe's albedo
// times one radiance, while the lamp's samples find the lobe's peak or nothing. Counted as so many at kWorthyAlpha over
// the lobe's width, it leaves them 0.5 % of a mirror's light instead of 2 % (the tail of the GGX distribution).
constexpr float kMostCounted = 16.0f;

// Smaller is no solid angle in float arithmetic.
constexpr float kLeastSolidAngle = 1e-12f;

float solid_angle(const glm::vec3 corners[3])
{
    return std::max(static_cast<float>(make_spherical_triangle(corners).solid_angle), kLeastSolidAngle);
}

/// Half of a lobe's light comes from within this solid angle: normals lean by up to atan(alpha), directions by twice
/// as much.
float lobe_solid_angle(float alpha) { return std::min(4.0f * kPi * alpha * alpha, 2.0f * kPi); }

}  // namespace

void DirectLight::choose_samples(const SurfacePoint& point, const Workspace& w, Lobes& lobes) const
{
    if (!lobes.any) return;
    const float alpha = narrowest(*lobes.bsdf, lobes.reflecting);
    bool narrow = lobes.lit_by_gathered != 0u;
    narrow |= alpha < kLampsAlpha &&
              (candidates_.draws() || (sky_.has_peaks() && lobe_solid_angle(alpha) < sky_.peak_solid_angle()));
    if (!narrow && alpha < kLampsAlpha) {
        float lamps = 0.0f;
        for (const LampView& lamp : w.lamps) lamps += solid_angle(lamp.corner.data());
        narrow = lobe_solid_angle(alpha) < lamps;
    }
    if (!narrow) return;
    lobes.samples = alpha < kMirrorAlpha ? kMirrorSamples : kLobeSamples;
    lobes.counted = static_cast<float>(lobes.samples) * std::clamp(kWorthyAlpha / alpha, 1.0f, kMostCounted);
    lobes.total_estimate = lights_.tree->estimate(point.position, point.shading_normal, kTriangleCandidates);
}

float DirectLight::samples_towards(std::uint32_t triangle, const SurfacePoint& point, const Lobes& lobes) const
{
    const float estimate = lights_.tree->estimate(triangle, point.position, point.shading_normal);
    const float share = lobes.total_estimate > 0.0f ? std::min(estimate / lobes.total_estimate, 1.0f) : 0.0f;
    // A share of all samples, and where lamps are not picked two of its own unless it is one of the small rest (a
    // fiftieth of the light).
    const float own = options_.lamp_picks > 0 ? 0.0f : 2.0f * std::min(50.0f * share, 1.0f);
    const float samples = static_cast<float>(options_.area_samples) * share + own;
    const EmissiveTriangle& t = lights_.triangles[triangle];
    const glm::vec3 corners[3] = {t.corner[0] - point.position, t.corner[1] - point.position,
                                  t.corner[2] - point.position};
    return samples / solid_angle(corners);
}

float DirectLight::peak_samples_towards(glm::vec3 direction) const
{
    return static_cast<float>(options_.area_samples) * sky_.peak_density(direction);
}

/// Whether a ray can meet something that shines: quick, so that few rays are traced in vain.
bool DirectLight::may_meet_lamp(const SurfacePoint& point, glm::vec3 direction) const
{
    if (sky_.has_peaks() && sky_.peak_density(direction) > 0.0f) return true;
    return !lights_.triangles.empty() && lights_.tree->may_meet(point.position, direction);
}

/// Radiance that a ray along a lobe found, and what the lamps' own samples amount to there.
glm::vec3 DirectLight::light_along(const SurfacePoint& point, const Lobes& lobes, const HitPacket& packet, int lane,
                                   float& lamp_density) const
{
    const RayPacket& ray = packet.ray;
    const glm::vec3 direction(ray.direction_x[lane], ray.direction_y[lane], ray.direction_z[lane]);
    if (packet.geometry[lane] == RayPacket::kMiss) {
        lamp_density = peak_samples_towards(direction);
        return sky_.peak(direction);
    }
    const std::uint32_t index = lights_.emissive_triangle(packet.instance(lane), packet.primitive[lane]);
    if (index == Lights::kNone) return glm::vec3(0.0f);
    const EmissiveTriangle& triangle = lights_.triangles[index];
    if (!triangle.double_sided && glm::dot(triangle.normal, direction) >= 0.0f) return glm::vec3(0.0f);
    if (lies_on_plane(triangle, point)) return glm::vec3(0.0f);
    lamp_density = samples_towards(index, point, lobes);
    const glm::vec3 origin(ray.origin_x[lane], ray.origin_y[lane], ray.origin_z[lane]);
    return radiance_at(rays_, triangle, origin + ray.t_max[lane] * direction);
}

Lit DirectLight::along_lobes(const SurfacePoint& point, const Lobes& lobes, std::uint64_t key, Workspace& w) const
{
    Lit lit;
    static_assert(kLobeSamples <= RayPacket::kWidth);
    RandomStream random(mix64(key ^ 0xfffffffeull << 32));
    const glm::vec3 shift(random.next(), random.next(), random.next());
    BsdfSample samples[RayPacket::kWidth];
    RayPacket& ray = w.packet.ray;
    std::uint32_t active = 0;
    for (int i = 0; i < lobes.samples; ++i) {
        // The rank-1 lattice in three dimensions (Roberts 2018).
        const auto at = [i](float offset, double step) {
            return static_cast<float>(fraction(i * step + static_cast<double>(offset)));
        };
        const float choice = at(shift.x, 0.8191725133961645);
        BsdfSample& s = samples[i];
        s = lobes.seen->sample(choice, {at(shift.y, 0.6710436067037893), at(shift.z, 0.5497004779019703)});
        if (s.weight == glm::vec3(0.0f) || !(s.density > 0.0f) ||
            !(glm::dot(point.geometric_normal, s.incoming) > 0.0f) ||
            !(glm::dot(point.shading_normal, s.incoming) > 0.0f) || !may_meet_lamp(point, s.incoming))
            continue;
        set_lane(ray, static_cast<std::size_t>(i), ray_from(point, s.incoming));
        active |= 1u << i;
    }
    if (active == 0) return lit;
    LaneWeights weights;
    intersect(rays_, active, w.packet, weights);
    w.rays += static_cast<std::uint64_t>(std::popcount(active));
    tally(Count::highlight_rays, static_cast<std::uint64_t>(std::popcount(active)));
    const float n = static_cast<float>(lobes.samples);
    const SeenLobes lit_by_gathered(*lobes.bsdf, lobes.outgoing, lobes.lit_by_gathered);
    for (int i = 0; i < lobes.samples; ++i) {
        if ((active >> i & 1u) == 0u) continue;
        float towards = 0.0f;
        const glm::vec3 radiance = light_along(point, lobes, w.packet, i, towards);
        // Only rays along lobes find gathered lamps.
        const bool gathered = options_.gathered && w.packet.geometry[i] != RayPacket::kMiss && !lobes.is_behind &&
                              options_.gathered->has(w.packet.instance(i));
        if (gathered) towards = 0.0f;
        const glm::vec3 reflected = gathered
                                        ? glossy(*lobes.bsdf, lit_by_gathered, samples[i].incoming) / samples[i].density
                                        : samples[i].weight;
        lit.glossy += weights.weight[i] * radiance * reflected *
                      (power_heuristic(lobes.counted * samples[i].density, towards) / n);
    }
    return lit;
}

}  // namespace rcs
