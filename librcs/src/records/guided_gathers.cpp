#include "records/guided_gathers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "facts/scene_effects.h"
#include "gbuffer/visible_points.h"
#include "records/gather_waves.h"
#include "records/gatherer.h"
#include "records/hemisphere.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr std::size_t kTrials = 192;
// Lit points to begin with, per pixel, and at least.
constexpr double kPointsPerPixel = 0.3, kLeastPoints = 16384.0;
// What the points that all records share may bring of error, relative to what a record receives. It takes so many times
// the first points at the most; where it stays large even so, points are no use. Hardly more are not worth it.
constexpr double kErrorOfPoints = 0.01, kMostErrorOfPoints = 0.025, kMostMore = 8.0, kHardlyMore = 1.5,
                 kFewPoints = 0.25, kManyMore = 2.0;
// Noise of strata falls with that power of their number (allotment.h), of looks as by chance.
constexpr double kStrataFall = 0.7, kLooksFall = 0.5;
// Time of a ray that is spared most of its shadow rays, and of a look, over that of a ray with them (measured in
// sponza).
constexpr double kSparedRayCost = 1.15, kLookCost = 0.7;
// A smaller gain is not worth the points.
constexpr double kLeastGain = 1.25;
// A record below this part of the mean is judged as if it were as bright: it can hardly be seen.
constexpr double kDark = 0.1;

/// Of gathers at the probes: means relative to what is received.
struct Errors {
    double rays = 0.0, looks = 0.0, points = 0.0;  ///< standard errors, as each gather estimates them
    double all = 0.0;                              ///< the same of the whole, as two gathers differ
};

struct Probes {
    const GBuffer& gbuffer;
    std::vector<std::uint32_t> pixels;
    std::uint64_t seed;
    ThreadPool& pool;
    RayCaster* caster;  // may be null
};

/// Two gathers at each probe. @param sample  of the first one, sets them apart   @param guide  learns from them, if not
/// null
Errors gather_at(const Probes& probes, const Gatherer& gatherer, const GatherSize& size, std::uint64_t sample,
                 GatherGuide* guide)
{
    std::vector<glm::dvec4> found(probes.pixels.size());  // light by the first gather, then what the second one says
    std::vector<double> second(found.size());
    const GatherYield yield = gather_each(
        gatherer, probes.caster, 2 * found.size(), size.grid.cells,
        [&](std::size_t k) {
            return GatherTask{birth_at(probes.gbuffer, probes.pixels[k / 2], probes.seed, sample + k % 2), &size};
        },
        probes.pool,
        [&](std::size_t k, const Record& record, const GatherWorkspace& w) {
            const auto light = static_cast<double>(luminance(record.irradiance));
            glm::dvec4& f = found[k / 2];
            if (k % 2 == 0)
                f.x = light;
            else
                second[k / 2] = light, f.y = w.error_of_rays, f.z = w.error_of_looks, f.w = w.error_of_points;
        });
    if (guide) guide->learn(yield.seen);
    std::vector<double> difference(found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        difference[i] = std::abs(found[i].x - second[i]);
        found[i].x = 0.5 * (found[i].x + second[i]);
    }
    const double count = static_cast<double>(std::max<std::size_t>(1, found.size()));
    double mean = 0.0;
    for (const glm::dvec4& f : found) mean += f.x / count;
    Errors errors;
    // Of two normal deviates the mean difference is 2 / sqrt(pi) deviations.
    constexpr double kOfDifference = 0.5 / std::numbers::inv_sqrtpi;
    for (std::size_t i = 0; i < found.size() && mean > 0.0; ++i) {
        const double to_relative = 1.0 / ((found[i].x + kDark * mean) * count);
        errors.rays += to_relative * found[i].y;
        errors.looks += to_relative * found[i].z;
        errors.points += to_relative * found[i].w;
        errors.all += to_relative * kOfDifference * difference[i];
    }
    return errors;
}

/// Gathers with so many lit points.
struct Trial {
    std::unique_ptr<GatherGuide> guide;  ///< null: there is nothing to look at, or it does no good
    Errors errors;
};

/// The share of looks that leaves the least error in the same time; 0: none does any good. What gathers say of their
/// own error parts it between rays and looks; how large it is says the difference of two: strata of smooth light are
/// far better than they can tell.
/// @param guided  with half of the rays of `plain`, and as many looks
float best_share(const Errors& guided, const Errors& plain)
{
    const double scale = guided.all / std::max(1e-30, std::hypot(guided.rays, guided.looks));
    double least = plain.all / kLeastGain;
    float best = 0.0f;
    for (double share = 0.3; share < 0.85; share += 0.05) {
        const double of_rays = guided.rays * std::pow(0.5 / (1.0 - share), kStrataFall);
        const double of_looks = guided.looks * std::pow(0.5 / share, kLooksFall);
        const double time = (1.0 - share) * kSparedRayCost + share * kLookCost;
        const double error = scale * std::hypot(of_rays, of_looks) * std::pow(time, kStrataFall);
        if (error < least) least = error, best = static_cast<float>(share);
    }
    return best;
}

}  // namespace

std::unique_ptr<GatherGuide> make_gather_guide(const LitScene& scene, const GBuffer& gbuffer, const View& view,
                                               const RecordSettings& settings, ThreadPool& pool)
{
    if (settings.bounces == 0) return nullptr;
    const LitScene lit{scene.rays, settings.bounces > 1 ? scene.cache : nullptr, nullptr, scene.gathered};
    const Probes probes{gbuffer, spread_pixels(gbuffer, kTrials, settings.seed), settings.seed, pool, scene.caster};
    const GatherSize all{make_hemisphere_grid(settings.rays), 0};
    const GatherSize half{make_hemisphere_grid(settings.rays / 2), settings.rays - settings.rays / 2};
    const Errors plain = gather_at(probes, Gatherer(lit, settings), all, 0, nullptr);
    if (!(plain.all > 0.0)) return nullptr;
    const PlaceLight light{
        scene.rays, HitRadiance(scene.rays, nullptr, effects_or_scene(settings.effects, scene.rays), scene.gathered),
        least_hit_alpha(settings.rays), nullptr};
    const LightSurvey survey = survey_light(light, gbuffer, view, settings.seed, pool);
    const auto try_with = [&](double points) {
        Trial trial{std::make_unique<GatherGuide>(survey, points, pool), {}};
        if (!trial.guide->has_light()) return Trial{};
        const Gatherer guided({lit.rays, lit.cache, trial.guide.get(), lit.gathered}, settings);
        gather_at(probes, guided, half, 2, trial.guide.get());  // to learn who sees what
        trial.errors = gather_at(probes, guided, half, 4, trial.guide.get());
        trial.guide->share = best_share(trial.errors, plain);
        if (trial.guide->share == 0.0f) trial.guide.reset();
        return trial;
    };
    const double points = std::max(kLeastPoints, kPointsPerPixel * static_cast<double>(gbuffer.size()));
    // A few points tell whether looks do any good, if not yet how many it takes.
    const double few = std::max(kLeastPoints, kFewPoints * points);
    if (points > kManyMore * few && !try_with(few).guide) return nullptr;
    Trial trial = try_with(points);
    if (!trial.guide) return nullptr;
    const double wanted = std::min(kMostMore, std::pow(trial.errors.points / kErrorOfPoints, 2.0)) * points;
    if (wanted < kHardlyMore * points) return std::move(trial.guide);
    trial = try_with(wanted);
    return trial.errors.points > kMostErrorOfPoints ? nullptr : std::move(trial.guide);
}

}  // namespace rcs
