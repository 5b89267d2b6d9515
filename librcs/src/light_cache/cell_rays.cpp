#include "light_cache/cell_rays.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "util/basis.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kWidth = RayPacket::kWidth;
constexpr float kPi = std::numbers::pi_v<float>;
static_assert(CellRays::kRays == CellRays::kPackets * kWidth);

// The rank-1 sequence of the plastic number (Roberts 2018): every run of 16 of its points is spread evenly too.
constexpr float kStepTheta = 0.7548776662466927f, kStepPhi = 0.5698402909980532f;

float fraction(float x) { return x - std::floor(x); }

SurfaceSample sample_of(const SurfacePoint& point)
{
    return {point.position, point.position_error, point.geometric_normal, point.shading_normal};
}

}  // namespace

/// @return bit i is set where ray i leaves the surface
std::uint32_t CellRays::aim(const SurfaceSample& place, int first, glm::vec2 shift)
{
    const Basis frame(place.normal);
    const glm::vec3 origin = place.position + place.position_error * place.geometric_normal;
    RayPacket& ray = packet_.ray;
    std::uint32_t active = 0;
    for (int i = 0; i < kWidth; ++i) {
        const float n = static_cast<float>(first + i);
        const float sin2 = fraction(shift.x + n * kStepTheta);
        const float phi = 2.0f * kPi * fraction(shift.y + n * kStepPhi);
        const float sine = std::sqrt(sin2);
        const glm::vec3 d =
            sine * std::cos(phi) * frame.x + sine * std::sin(phi) * frame.y + std::sqrt(1.0f - sin2) * frame.z;
        set_lane(ray, static_cast<std::size_t>(i), {origin, d});
        active |= static_cast<std::uint32_t>(glm::dot(d, place.geometric_normal) > 0.0f) << i;
    }
    return active;
}

void CellRays::shade(const HitSurface& hit, int lane, std::uint64_t key, CellHit& result)
{
    // A ray stands for 1/64 of the hemisphere's projected solid angle pi.
    const float cone_width = packet_.ray.t_max[lane] * std::sqrt(kPi / static_cast<float>(kRays));
    RandomStream random(key);
    const glm::vec3 weight = weights_.weight[lane];
    const auto add = [&](const Ray& ray, glm::vec3 radiance) {
        shadow_.add(ray);
        lit_.push_back(radiance);
    };
    if (radiance_.is_plain(packet_.instance(lane))) {
        const HitRadiance::PlainHit plain{hit.point.material, hit.point.uv, hit.uv_per_length, cone_width};
        const glm::vec3 outgoing = -ray_direction(packet_.ray, lane);
        result.reflectance = weight * radiance_.albedo(plain, glm::dot(hit.point.shading_normal, outgoing));
        radiance_.direct(hit.point, random, [&](const Ray& ray, glm::vec3 white) {
            add(ray, white * weight * radiance_.reflectance(plain, hit.point.shading_normal, outgoing, ray.direction));
        });
        return;
    }
    const MaterialValues surface = radiance_.widened_values(packet_, lane, hit, cone_width, least_hit_alpha(kRays));
    const Bsdf& bsdf = surface.bsdf;
    const glm::vec3 outgoing = -ray_direction(packet_.ray, lane);
    result.reflectance = weight * total_albedo(bsdf, outgoing);
    if (const LobeSet behind = bsdf.those(is_diffuse_behind)) {
        // One link is all that a ray has: to one side or the other, by chance.
        const glm::vec3 through = weight * albedo(bsdf, outgoing, behind);
        const float chance = luminance(through) / std::max(luminance(through + result.reflectance), 1e-30f);
        const bool passes = random.next() < chance;
        result.reflectance = passes ? through / chance : result.reflectance / (1.0f - chance);
        if (passes) result.surface = sample_of(other_side(hit.point));
    }
    radiance_.direct(hit.point, bsdf, outgoing, random,
                     [&](const Ray& ray, glm::vec3 radiance, glm::vec3) { add(ray, weight * radiance); });
}

void CellRays::trace(const std::array<SurfaceSample, kPackets>& places, std::uint64_t key, bool direct)
{
    RandomStream random(key);
    const glm::vec2 shift(random.next(), random.next());
    shadow_.clear();
    lit_.clear();
    for (int p = 0; p < kPackets; ++p) {
        const std::uint32_t active = aim(places[static_cast<std::size_t>(p)], p * kWidth, shift);
        intersect(rays_, active, packet_, weights_);
        ray_count += static_cast<std::uint64_t>(std::popcount(active));
        FacePacket faces;
        find_faces(rays_, packet_, faces);
        for (int i = 0; i < kWidth; ++i) {
            CellHit& result = hits_[static_cast<std::size_t>(p * kWidth + i)];
            result.hit = (active >> i & 1u) != 0u && packet_.geometry[i] != RayPacket::kMiss;
            if (!result.hit) continue;
            HitSurface hit = begin_hit(rays_, packet_, faces, i);
            complete_hit(rays_, packet_, i, hit);
            result.surface = sample_of(hit.point);
            if (direct) shade(hit, i, mix64(key + static_cast<std::uint64_t>(p * kWidth + i + 1)), result);
        }
    }
    shadow_.trace(rays_);
    shadow_ray_count += shadow_.size();
    direct_irradiance_ = glm::vec3(0.0f);
    for (std::size_t i = 0; i < shadow_.size(); ++i)
        if (shadow_.is_free(i)) direct_irradiance_ += shadow_.transmittance(i) * lit_[i];
    direct_irradiance_ *= kPi / static_cast<float>(kRays);
}

}  // namespace rcs
