#include "lit_points/lamp_guide.h"

#include <algorithm>
#include <cmath>

#include "rays/shadow_batch.h"

namespace rcs {
namespace {

// Points on the lamps, per pixel of the picture, and at least.
constexpr double kPointsPerPixel = 0.3, kLeastPoints = 131072.0;
// Looks of each place at first and afterwards: what the first found guides the others.
constexpr int kLooks = 16, kRounds = 2;
constexpr std::size_t kPlacesAtATime = 256;
// Of the chances in a cell, what goes by power alone: from some of its places more is seen than from its mean.
constexpr double kEvenPart = 0.05;
// Running sums are looked through by so many at a time: those at the ends of these come first, next to each other.
constexpr std::size_t kSumsOfStep = 16;
// Of which nothing was learned.
constexpr std::uint64_t kNoCell = ~0ull;

double points_for(const GBuffer& g) { return std::max(kLeastPoints, kPointsPerPixel * static_cast<double>(g.size())); }

Ray ray_to(const GatherGuide& guide, const SurfacePoint& from, const GatherGuide::Choice& c)
{
    Ray ray = ray_from(from, c.direction);
    const glm::vec3 way = guide.lit().end_of_ray(c.point, from.position) - ray.origin;
    ray.t_max = glm::length(way);
    ray.direction = way / ray.t_max;
    return ray;
}

}  // namespace

LampGuide::LampGuide(const RayScene& rays, const EffectSet& effects, const GatheredLamps& gathered,
                     const GBuffer& gbuffer, const View& view, std::uint64_t seed, ThreadPool& pool)
    : guide_(survey_light({rays, HitRadiance(rays, nullptr, effects), 1.0f, &gathered}, gbuffer, view, mix64(seed + 1),
                          pool),
             points_for(gbuffer), pool)
{
    if (!guide_.has_light()) return;
    const HitRadiance dark(rays, nullptr, effects);
    const std::vector<SurfaceSample> places = places_in_view(rays, dark, gbuffer, seed, pool);
    for (int round = 0; round < kRounds; ++round)
        learn(rays, places, stream_key(seed, Stream::lit_points, static_cast<std::uint64_t>(round)), pool);
    weigh_cells(places);
}

std::size_t LampGuide::steps() const { return (guide_.clusters() - 1) / kSumsOfStep; }

/// @param place  that stands for a cell
void LampGuide::add_chances(const GatherGuide::Place& place, std::vector<float>& sums) const
{
    const std::size_t clusters = guide_.clusters(), first = sums.size();
    sums.resize(first + steps() + clusters, 0.0f);
    float* const chance = sums.data() + first + steps();
    guide_.weigh_clusters(place, chance);
    double total = 0.0, power = 0.0;
    for (std::size_t i = 0; i < clusters; ++i) {
        total += static_cast<double>(chance[i]);
        power += static_cast<double>(guide_.power(i));
    }
    const double even = total > 0.0 ? kEvenPart : 1.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < clusters; ++i) {
        sum += even * static_cast<double>(guide_.power(i)) / power;
        if (total > 0.0) sum += (1.0 - even) * static_cast<double>(chance[i]) / total;
        chance[i] = static_cast<float>(sum);
    }
    for (std::size_t k = 0; k < steps(); ++k) sums[first + k] = chance[kSumsOfStep * (k + 1) - 1];
}

/// For all cells that places lie in, as the mean of their places sees the clusters.
void LampGuide::weigh_cells(std::span<const SurfaceSample> places)
{
    struct Mean {
        glm::dvec3 position{0.0}, normal{0.0};
        double count = 0.0;
        LookCells cells;
    };
    for (std::size_t level = 0; level < cells_.size(); ++level) {
        std::vector<Mean> means;
        for (const SurfaceSample& p : places) {
            const LookCells cells = guide_.cells(p.position, p.normal);
            const std::uint32_t number =
                cells_[level].table.find_or_insert(cells[level], static_cast<std::uint32_t>(means.size()));
            if (number == means.size()) means.emplace_back().cells = cells;
            means[number].position += glm::dvec3(p.position);
            means[number].normal += glm::dvec3(p.normal);
            means[number].count += 1.0;
        }
        for (const Mean& mean : means) {
            LookCells cells = mean.cells;
            if (level > 0) cells[0] = kNoCell;
            const glm::vec3 normal(mean.normal);
            const GatherGuide::Place place{glm::vec3(mean.position / mean.count),
                                           normal / std::max(glm::length(normal), 1e-30f), cells};
            add_chances(place, cells_[level].sums);
        }
    }
}

/// Null where nothing is known: there samples that know nothing have all of the light.
const float* LampGuide::chances_at(const SurfacePoint& point) const
{
    if (!guide_.has_light()) return nullptr;
    const LookCells cells = guide_.cells(point.position, point.shading_normal);
    for (std::size_t level = 0; level < cells.size(); ++level)
        if (const std::uint32_t number = cells_[level].table.find(cells[level]); number != CellTable::kNone)
            return cells_[level].sums.data() + number * (steps() + guide_.clusters());
    return nullptr;
}

void LampGuide::learn(const RayScene& rays, std::span<const SurfaceSample> places, std::uint64_t seed, ThreadPool& pool)
{
    std::vector<std::vector<Look>> found((places.size() + kPlacesAtATime - 1) / kPlacesAtATime);
    pool.parallel_for(found.size(), 1, [&](std::size_t begin, std::size_t end, int) {
        GatherGuide::Scratch scratch;
        std::vector<GatherGuide::Choice> choices;
        ShadowBatch shadow;
        for (std::size_t b = begin; b < end; ++b)
            for (std::size_t i = b * kPlacesAtATime; i < std::min(places.size(), (b + 1) * kPlacesAtATime); ++i) {
                const SurfacePoint p = point_of(places[i]);
                const LookCells cells = guide_.cells(p.position, p.shading_normal);
                RandomStream random(stream_key(seed, Stream::lit_points, i));
                guide_.choose({p.position, p.shading_normal, cells}, kLooks, random, scratch, choices);
                shadow.clear();
                for (const GatherGuide::Choice& c : choices) shadow.add(ray_to(guide_, p, c));
                shadow.trace(rays);
                for (std::size_t k = 0; k < choices.size(); ++k)
                    found[b].push_back({cells, choices[k].cluster, shadow.is_free(k)});
            }
    });
    for (const std::vector<Look>& looks : found) guide_.learn(looks);
}

HitLights::Sample LampGuide::sample(const SurfacePoint& point, RandomStream& random) const
{
    HitLights::Sample result;
    const glm::vec3 normal = point.shading_normal;
    const float* const ends = chances_at(point);
    if (!ends) return result;
    const std::size_t clusters = guide_.clusters();
    const float* const sums = ends + steps();
    const float at = random.next() * sums[clusters - 1];
    const float* const from = sums + kSumsOfStep * static_cast<std::size_t>(std::upper_bound(ends, sums, at) - ends);
    const std::size_t cluster =
        static_cast<std::size_t>(std::upper_bound(from, std::min(from + kSumsOfStep, sums + clusters - 1), at) - sums);
    const float chance = (sums[cluster] - (cluster > 0 ? sums[cluster - 1] : 0.0f)) / sums[clusters - 1];
    const float u = random.next();
    const glm::vec2 uv(u, random.next());
    GatherGuide::Choice c;
    if (!(chance > 0.0f) || !guide_.choose_of(cluster, point.position, normal, 1.0f / chance, uv, c)) return result;
    guide_.aim(point.position, c);
    if (!(glm::dot(c.direction, point.geometric_normal) > 0.0f)) return result;
    result.irradiance = c.part * c.inverse_chance * guide_.lit().lights[c.point].radiance_area;
    result.to_light = c.direction;
    result.shadow_ray = ray_to(guide_, point, c);
    result.lamp = guide_.lit().lights[c.point].lamp;
    return result;
}

float LampGuide::part_left(const SurfacePoint& point, const HitLights::Sample& sample,
                           const EmissiveTriangle& lamp) const
{
    if (!chances_at(point)) return 1.0f;
    const glm::vec3 at = sample.shadow_ray.origin + sample.shadow_ray.t_max * sample.shadow_ray.direction;
    const glm::vec3 way = at - point.position;
    const float d2 = glm::dot(way, way), there = -glm::dot(lamp.normal, way),
                here = glm::dot(point.shading_normal, way);
    const float bound = guide_.bound(at, there > 0.0f ? lamp.normal : -lamp.normal);
    const float g = here * std::abs(there) / (d2 * d2);
    return bound > 0.0f ? g / (g + bound) : 1.0f;
}

}  // namespace rcs
