#include "glossy/lobe_looks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Narrower lobes show what their rays meet as a mirror does: neighbours have nothing in common.
constexpr float kLeastAlphaOfLooks = 0.03f;
// Less than a record's: its looks are few, and learned from so many that what was never seen is mostly not to be seen.
constexpr float kLeastChance = 0.01f;
// Points of a cluster that one is chosen from by what it sends along the lobe.
constexpr int kTried = LightClusters::kCandidates;

}  // namespace

/// Where a pixel's looks start, and the lobes they are for.
struct LobeLooks::Viewed {
    Bsdf bsdf;
    LobeSet traced;
    glm::vec3 outgoing, position, geometric_normal;
    LookCells cells;
    float albedo;  // luminance
    SeenLobes seen{bsdf, outgoing, traced};

    /// pi times the part of the lobes' light that comes from a direction, per solid angle.
    float density(glm::vec3 incoming) const
    {
        return std::numbers::pi_v<float> * luminance(seen.evaluate(incoming)) *
               std::abs(glm::dot(bsdf.normal, incoming)) / albedo;
    }
};

bool LobeLooks::looks(const Bsdf& bsdf, LobeSet traced)
{
    return (traced & transmitting_lobes(bsdf)) == 0u && narrowest(bsdf, traced) >= kLeastAlphaOfLooks;
}

float LobeLooks::bound(const HitPacket& packet, int lane, const HitSurface& hit) const
{
    if (!guide_.can_be_lit(packet.instance(lane))) return 0.0f;
    const glm::vec3 normal = hit.point.geometric_normal;
    const float t = packet.ray.t_max[lane], facing = -glm::dot(normal, ray_direction(packet.ray, lane));
    return facing > 0.0f ? guide_.bound(hit.point.position, normal) * t * t / facing : 0.0f;
}

/// About what each cluster sends along the lobes. @return the sum
double LobeLooks::weigh_clusters(const Viewed& from, Workspace& w) const
{
    const std::size_t clusters = guide_.clusters();
    w.importance.resize(clusters);
    w.lobe.assign(clusters, 0.0f);
    guide_.weigh_clusters({from.position, from.bsdf.normal, from.cells}, w.importance.data(), kLeastChance);
    for (std::uint32_t i = 0; i < from.bsdf.count; ++i)
        if ((from.traced >> i & 1u) != 0u)
            guide_.light_clusters().add_lobe(from.position, from.bsdf.normal, from.outgoing, from.bsdf.lobe[i].alpha,
                                             luminance(albedo(from.bsdf, from.outgoing, 1u << i)), w.lobe.data());
    double sum = 0.0;
    for (std::size_t i = 0; i < clusters; ++i) sum += static_cast<double>(w.importance[i] *= w.lobe[i]);
    return sum;
}

/// One of a few points of a cluster, by what they send along the lobes (resampled importance sampling; Talbot et al.
/// 2005). @param inverse_chance  of the cluster   @return whether any sends something
bool LobeLooks::choose(const Viewed& from, std::size_t cluster, float inverse_chance, RandomStream& random,
                       GatherGuide::Choice& choice) const
{
    const LightClusters::Range range = guide_.light_clusters().points_of(cluster);
    const auto offset = static_cast<std::uint32_t>(random.next() * static_cast<float>(range.count));
    float part[kTried], target[kTried], sum = 0.0f;
    for (std::uint32_t c = 0; c < kTried; ++c) {
        const LitPoint& point = guide_.lit().points[range.first + (offset + c) % range.count];
        const glm::vec3 way = point.position - from.position;
        const float d2 = glm::dot(way, way) + 1e-30f;
        const glm::vec3 direction = way / std::sqrt(d2);
        const float facing = -glm::dot(point.normal, direction);
        part[c] = target[c] = 0.0f;
        if (!(facing > 0.0f && point.bound > 0.0f) || glm::dot(from.geometric_normal, direction) <= 0.0f) continue;
        const float density = from.density(direction) * facing / d2;
        part[c] = facing / d2;
        target[c] = density * point.bound / (point.bound + density) * point.power;
        sum += target[c];
    }
    if (!(sum > 0.0f)) return false;
    std::uint32_t chosen = 0;
    for (float rest = random.next() * sum; chosen + 1 < kTried && (rest -= target[chosen]) >= 0.0f;) ++chosen;
    if (!(target[chosen] > 0.0f)) return false;
    choice.point = range.first + (offset + chosen) % range.count;
    choice.part = part[chosen];
    choice.inverse_chance =
        inverse_chance * sum * static_cast<float>(range.count) / (static_cast<float>(kTried) * target[chosen]);
    guide_.aim(from.position, choice);
    return true;
}

void LobeLooks::look(std::size_t pixel, std::uint64_t key, RayRing& ring, Workspace& w, ShadowBatch& shadow,
                     std::vector<PendingLight>& lights) const
{
    const std::span<LobeRay> looks = ring.looks_of(pixel);
    std::fill(looks.begin(), looks.end(), LobeRay{});
    const Bsdf bsdf = shading_.bsdf(g_, pixel);
    const LobeSet traced = bsdf.those(lit_by_rays);
    if (looks.empty() || !LobeLooks::looks(bsdf, traced)) return;
    const glm::vec3 outgoing = outgoing_at(g_, view_.camera, pixel), position = g_.scene_position(pixel);
    const Viewed from{bsdf,
                      traced,
                      outgoing,
                      position,
                      g_.geometric_normal[pixel],
                      guide_.cells(position, bsdf.normal),
                      luminance(albedo(bsdf, outgoing, traced))};
    if (!(from.albedo > 0.0f)) return;
    const double stratum = weigh_clusters(from, w) / static_cast<double>(looks.size());
    if (!(stratum > 0.0)) return;
    const glm::vec3 origin = from.position + g_.position_error[pixel] * from.geometric_normal;
    RandomStream random(key);
    std::size_t cluster = 0;
    double reached = 0.0;  // importance of the clusters before
    for (std::size_t k = 0; k < looks.size(); ++k) {
        const double at = (static_cast<double>(k) + static_cast<double>(random.next())) * stratum;
        while (cluster + 1 < w.importance.size() && reached + static_cast<double>(w.importance[cluster]) <= at)
            reached += static_cast<double>(w.importance[cluster++]);
        GatherGuide::Choice choice{};
        if (!(w.importance[cluster] > 0.0f) ||
            !choose(from, cluster, static_cast<float>(stratum / static_cast<double>(w.importance[cluster])), random,
                    choice) ||
            guide_.lit().lights[choice.point].bsdf != LitPointLight::kPlain)
            continue;
        LobeRay& own = looks[k];
        own.target = g_.position(pixel) + choice.distance * choice.direction;
        own.distance = choice.distance;
        own.density = 1.0f;  // of a solid angle that its radiance is multiplied with
        LitPart& lit = ring.lit(own);
        lit = {glm::vec3(0.0f), guide_.lit().points[choice.point].bound / choice.part};
        const glm::vec3 way = guide_.lit().end_of_ray(choice.point, from.position) - origin;
        const float length = glm::length(way);
        shadow.add({origin, way / length, 0.0f, length});
        w.looks.push_back({from.cells, static_cast<std::uint16_t>(cluster), false});
        lights.push_back({&lit.radiance, choice.part * choice.inverse_chance *
                                             guide_.lit().radiance_area(light_, choice.point, -choice.direction)});
    }
}

}  // namespace rcs
