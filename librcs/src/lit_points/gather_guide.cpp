#include "lit_points/gather_guide.h"

#include <cmath>
#include <utility>

#include "util/random.h"

namespace rcs {
namespace {

// Integral of the bound over all surfaces. A geometry term of the bound is where rays and lit points share a surface's
// light evenly: with so many equal parts of what is lit, one of them has a solid angle of 1 there if seen squarely
// (measured in sponza and veach-ajar: from a third to three times as much does as well).
constexpr double kBound = 500.0;

}  // namespace

GatherGuide::GatherGuide(const LightSurvey& survey, double points, ThreadPool& pool) : importance_(survey.importance)
{
    const PlaceLight& light = survey.light;
    for (std::uint32_t i = 0; i < light.rays.impl().instances.size(); ++i)
        lit_.push_back(rcs::can_be_lit(light.rays, i));
    if (!(survey.bright > 0.0)) return;
    const PointDensity density = density_of_points(survey, points);
    lit_points_ = light_places(light, draw_places(survey, density, survey.seed + 6, pool), survey.seed + 8, pool);
    const float per_density = static_cast<float>(kBound / points);
    bound_ = {per_density * density.bright, per_density * density.seen, per_density * density.even};
    for (LitPoint& point : lit_points_.points) point.bound = bound(point.position, point.normal);
    clusters_ = LightClusters(lit_points_);
    clusters_.set_bounds(lit_points_.points);
    learned_ = LearnedVisibility(importance_.grid(), clusters_.size());
}

bool GatherGuide::leave_out(Movers moved, ThreadPool& pool)
{
    // Half of it with each move: noise of veach-ajar's floor after seven of them 30 in place of 15 %.
    constexpr int kMovesToFade = 8;
    moved_ = std::move(moved);
    std::vector<LitPoint>& points = lit_points_.points;
    pool.parallel_for(points.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) points[i].bound = bound(points[i].position, points[i].normal);
    });
    clusters_.set_bounds(points);
    if (++moves_ % kMovesToFade == 0) learned_.fade();
    // What nobody sees is no loss.
    double lost = 0.0, all = 0.0;
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
        const LightClusters::Range range = clusters_.points_of(i);
        double power = 0.0;
        for (std::uint32_t k = 0; k < range.count; ++k) power += static_cast<double>(points[range.first + k].power);
        const auto seen = static_cast<double>(learned_.chance(i));
        all += seen * power;
        lost += seen * (power - static_cast<double>(clusters_.power(i)));
    }
    // The fewer rays that there are have to leave no more error of it than looks leave in all.
    const double most = std::sqrt(1.0 - static_cast<double>(share)) / static_cast<double>(gain);
    return lost < most * all;
}

void GatherGuide::weigh_clusters(const Place& place, float* importance, float least_chance) const
{
    learned_.estimate(place.cells, least_chance, importance);
    clusters_.weigh(place.position, place.normal, importance);
}

bool GatherGuide::choose_of(std::size_t cluster, glm::vec3 position, glm::vec3 normal, float inverse_chance,
                            glm::vec2 u, Choice& choice) const
{
    const LightClusters::Pick pick = clusters_.pick(cluster, position, normal, u);
    if (!(pick.part > 0.0f)) return false;
    choice = {pick.point, static_cast<std::uint16_t>(cluster), {}, 0.0f,
              pick.part,  inverse_chance * pick.inverse_chance};
    return true;
}

void GatherGuide::aim(glm::vec3 position, Choice& choice) const
{
    const glm::vec3 way = lit_points_.points[choice.point].position - position;
    choice.distance = glm::length(way);
    choice.direction = way / choice.distance;
}

void GatherGuide::choose(const Place& place, int count, RandomStream& random, Scratch& scratch,
                         std::vector<Choice>& choices) const
{
    choices.clear();
    const std::size_t clusters = clusters_.size();
    scratch.importance.resize(clusters);
    scratch.sums.resize(clusters);
    scratch.strata.clear();
    float* const importance = scratch.importance.data();
    weigh_clusters(place, importance);
    double total = 0.0;
    for (std::size_t i = 0; i < clusters; ++i) scratch.sums[i] = total += static_cast<double>(importance[i]);
    if (!(total > 0.0)) return;
    const double stratum = total / count;
    std::size_t cluster = 0;
    for (int k = 0; k < count; ++k) {
        const double at = (static_cast<double>(k) + static_cast<double>(random.next())) * stratum;
        while (cluster + 1 < clusters && scratch.sums[cluster] <= at) ++cluster;
        const float u = random.next();
        const glm::vec2 uv(u, random.next());
        if (!(importance[cluster] > 0.0f)) continue;
        scratch.strata.push_back({static_cast<std::uint32_t>(cluster), uv});
        // What they read lies anywhere in memory: asked for now, read below.
        clusters_.prefetch(cluster, uv.x);
    }
    for (const auto& [of, uv] : scratch.strata) {
        Choice choice;
        if (!choose_of(of, place.position, place.normal,
                       static_cast<float>(stratum / static_cast<double>(importance[of])), uv, choice))
            continue;
        __builtin_prefetch(&lit_points_.points[choice.point]);
        __builtin_prefetch(&lit_points_.lights[choice.point]);
        choices.push_back(choice);
    }
    for (Choice& choice : choices) aim(place.position, choice);
}

}  // namespace rcs
