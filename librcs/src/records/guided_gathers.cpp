#include "records/guided_gathers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "facts/scene_effects.h"
#include "gbuffer/visible_points.h"
#include "light_cache/direct_cells.h"
#include "records/gather.h"
#include "records/gather_waves.h"
#include "records/gatherer.h"
#include "records/hemisphere.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// A small picture has few records, which what tells them where to look must not outweigh: at the most one trial for so
// many pixels. These bounds, and that of points per pixel, begin to matter below 32 x 32; with a quarter of the points
// the light of pictures of 32 x 32 was off in lobe_render_test.
constexpr std::size_t kMostTrials = 192, kFewestTrials = 32, kPixelsPerTrial = 5;
// Lit points to begin with, per pixel, and at least; of a small picture no more per pixel than that.
constexpr double kPointsPerPixel = 0.3, kLeastPoints = 16384.0, kMostPointsPerPixel = 16.0;
// What the points that all records share may bring of error, relative to what a record receives. It takes so many times
// the first points at the most; where it stays large even so, and is no small part of what rays alone would leave of
// their own, points are no use (demo:ajar, veach-ajar: .03 beside .40 to .45 do good). Hardly more are not worth it.
constexpr double kErrorOfPoints = 0.01, kMostErrorOfPoints = 0.025, kMostPartOfPoints = 0.1, kMostMore = 8.0,
                 kHardlyMore = 1.5, kFewPoints = 0.25, kManyMore = 2.0;
// Noise of strata falls with that power of their number (allotment.h), of looks as by chance.
constexpr double kStrataFall = 0.7, kLooksFall = 0.5;
// Time of a ray that is spared most of its shadow rays, and of a look, over that of a ray with them (measured in
// sponza).
constexpr double kSparedRayCost = 1.15, kLookCost = 0.7;
// Of a ray without shadow rays, where the light at its end is known.
constexpr double kKnowingRayCost = 0.6;
// A smaller gain is not worth knowing it.
constexpr double kLeastGainOfCells = 1.25;
// Where samples of light are less of the variance, it does not pay to know it.
constexpr double kLeastOfLight = 0.4;
// Of those that light the cells: fewer than the shadow rays that records are spared, and some dozens for each of the
// most cells that there are. More do little against what all records share of their error: in sibenik's nave at 1000 x
// 1000 it is .0099, .0086, .0075, .0069, .0066 with 2, 4, 8, 16, 32 million, in demo:blinds .0274, .0256, .0231 with 2,
// 7, 29.
constexpr double kSamplesPerPixel = 32.0, kMostSamples = 4e6;
// Error that all records may share by that, which has no edges and no clouds: so much, or that part of a gather's own.
// Where so many times the samples make it that, they are taken: of living-room's seeds, some had it a little larger,
// and their pictures took 100 in place of 60 s and were the worse for it.
constexpr double kMostErrorOfCells = 0.05, kMostPartOfCells = 0.1, kMoreSamples = 4.0;
// A smaller gain is not worth the points. It is measured thrice, each time with more of them, and has to be there each
// time. It says nothing of gradients and spacing, which fewer strata leave less sure: in demo:atrium and castle it came
// out as .95 to 1.18 at last, and pictures had 1.2 to 1.4 times the error of those without; at 1.2 to 1.5 (cornell-box,
// demo:cornell, cornell-animated; it scatters by a tenth) they are as good in the same time or a tenth worse; at 1.8
// and more (cornell-original, sponza/gallery and arcade, crytek-sponza) better.
constexpr double kLeastGain = 1.5;
// First gathers, of which there may be no others, have room for fewer looks than are best: of 48 rays for a quarter.
// What these gain has to be worth it, too: at 48 and 64 rays in sponza and crytek-sponza it is 1.0 to 1.5, and squared
// errors of pictures were 1.2 to 1.5 times those without in the same time; in veach-ajar 1.6 to 2.6, and half.
constexpr double kLeastFirstGain = 1.3;
// A larger one asks for nothing else.
constexpr double kSureGain = 2.0;
// A record below this part of the mean is judged as if it were as bright: it can hardly be seen.
constexpr double kDark = 0.1;

/// Of gathers at the probes: means relative to what is received, the light of gathered lamps left out.
struct Errors {
    double rays = 0.0, looks = 0.0, points = 0.0;  ///< standard errors, as each gather estimates them
    double all = 0.0;                              ///< the same of the whole, as two gathers differ
};

/// Where gathers tell what is worth while. The processor traces their rays: were a device's roundings to decide, whole
/// pictures would differ.
struct Probes {
    const GBuffer& gbuffer;
    std::vector<std::uint32_t> pixels;
    std::uint64_t seed;
    ThreadPool& pool;
};

/// What arrives at each probe, the light of gathered lamps left out, by two gathers; of the second one its workspace's
/// errors are noted.
struct Pairs {
    std::vector<double> first, second;
    std::vector<glm::dvec3> errors;  // of rays, looks, points
};

/// @param birth  of (probe, which of the two)   @param guide  learns from them, if not null
template <typename BirthOf>
Pairs gather_pairs(const Probes& probes, const Gatherer& gatherer, const GatherSize& size, GatherGuide* guide,
                   const BirthOf& birth)
{
    const std::size_t count = probes.pixels.size();
    Pairs found{std::vector<double>(count), std::vector<double>(count), std::vector<glm::dvec3>(count)};
    const GatherYield yield = gather_each(
        gatherer, nullptr, 2 * count, size.grid.cells,
        [&](std::size_t k) { return GatherTask{birth(k / 2, static_cast<std::uint64_t>(k % 2)), &size}; }, probes.pool,
        [&](std::size_t k, const Record& record, const GatherWorkspace& w) {
            const auto light = static_cast<double>(luminance(record.irradiance - record.of_lamps));
            (k % 2 == 0 ? found.first : found.second)[k / 2] = light;
            if (k % 2 == 1) found.errors[k / 2] = {w.error_of_rays, w.error_of_looks, w.error_of_points};
        });
    if (guide) guide->learn(yield.seen);
    return found;
}

/// Means over the probes, relative to what is received.
Errors errors_of(const Pairs& pairs)
{
    const double count = static_cast<double>(std::max<std::size_t>(1, pairs.first.size()));
    double mean = 0.0;
    for (std::size_t i = 0; i < pairs.first.size(); ++i) mean += 0.5 * (pairs.first[i] + pairs.second[i]) / count;
    Errors errors;
    // Of two normal deviates the mean difference is 2 / sqrt(pi) deviations.
    constexpr double kOfDifference = 0.5 / std::numbers::inv_sqrtpi;
    for (std::size_t i = 0; i < pairs.first.size() && mean > 0.0; ++i) {
        const double light = 0.5 * (pairs.first[i] + pairs.second[i]);
        const double to_relative = 1.0 / ((light + kDark * mean) * count);
        errors.rays += to_relative * pairs.errors[i].x;
        errors.looks += to_relative * pairs.errors[i].y;
        errors.points += to_relative * pairs.errors[i].z;
        errors.all += to_relative * kOfDifference * std::abs(pairs.first[i] - pairs.second[i]);
    }
    return errors;
}

/// Two gathers at each probe. @param sample  of the first one, sets them apart   @param guide  learns from them, if not
/// null
Errors gather_at(const Probes& probes, const Gatherer& gatherer, const GatherSize& size, std::uint64_t sample,
                 GatherGuide* guide)
{
    return errors_of(gather_pairs(probes, gatherer, size, guide, [&](std::size_t i, std::uint64_t k) {
        return birth_at(probes.gbuffer, probes.pixels[i], probes.seed, sample + k);
    }));
}

/// Part of the error that samples of lamps and sky have where rays end: the same rays twice.
double error_of_light(const Probes& probes, const Gatherer& gatherer, const GatherSize& size)
{
    return errors_of(gather_pairs(probes, gatherer, size, nullptr,
                                  [&](std::size_t i, std::uint64_t k) {
                                      Birth birth = birth_at(probes.gbuffer, probes.pixels[i], probes.seed);
                                      birth.light = k;
                                      return birth;
                                  }))
        .all;
}

/// Error that all records share by the cells' noise: the same rays and one half of the cells' samples, then the other.
double error_of_cells(const Probes& probes, LitScene lit, const RecordSettings& settings, const GatherSize& size,
                      DirectCells& cells)
{
    lit.direct = &cells;
    const Gatherer gatherer(lit, settings);
    Pairs halves;
    for (const DirectCells::Half half : {DirectCells::Half::first, DirectCells::Half::second}) {
        cells.half = half;
        Pairs found = gather_pairs(probes, gatherer, size, nullptr, [&](std::size_t i, std::uint64_t k) {
            return birth_at(probes.gbuffer, probes.pixels[i], probes.seed, k);
        });
        for (std::size_t i = 0; i < found.first.size(); ++i) found.first[i] = 0.5 * (found.first[i] + found.second[i]);
        halves.errors = std::move(found.errors);
        (half == DirectCells::Half::first ? halves.first : halves.second) = std::move(found.first);
    }
    cells.half = DirectCells::Half::both;
    // Halves have twice the variance of the whole.
    return errors_of(halves).all * std::numbers::sqrt2 / 2.0;
}

/// Gathers with so many lit points.
struct Trial {
    std::unique_ptr<GatherGuide> guide;  ///< null: there is nothing to look at, or it does no good
    Errors errors;
    double error = 0.0;  ///< with the best share of looks, in the time of a gather without
};

struct BestShare {
    float share = 0.0f;  ///< of looks; 0: none does any good
    double error;        ///< that it leaves in the same time
};

/// What a gather with that share of looks leaves of error, in the time of one without.
/// @param guided  with half of the rays of one without, and as many looks
double error_at(double share, const Errors& guided)
{
    const double scale = guided.all / std::max(1e-30, std::hypot(guided.rays, guided.looks));
    const double of_rays = guided.rays * std::pow(0.5 / (1.0 - share), kStrataFall);
    const double of_looks = guided.looks * std::pow(0.5 / share, kLooksFall);
    const double time = (1.0 - share) * kSparedRayCost + share * kLookCost;
    return scale * std::hypot(of_rays, of_looks) * std::pow(time, kStrataFall);
}

/// The share of looks that leaves the least error in the same time. What gathers say of their
/// own error parts it between rays and looks; how large it is says the difference of two: strata of smooth light are
/// far better than they can tell.
BestShare best_share(const Errors& guided, const Errors& plain, int rays)
{
    BestShare best{0.0f, plain.all / kLeastGain};
    for (double share = 0.3; share < 0.85; share += 0.05)
        if (const double error = error_at(share, guided); error < best.error) best = {static_cast<float>(share), error};
    const double first = std::min(static_cast<double>(best.share), static_cast<double>(most_first_looks(rays)) / rays);
    if (best.share > 0.0f && error_at(first, guided) * kLeastFirstGain > plain.all) best.share = 0.0f;
    return best;
}

struct CellTrial {
    std::unique_ptr<DirectCells> cells;  ///< null: they do no good
    double error = 0.0;                  ///< as in Trial
};

/// Lights the surfaces that rays end on, if that tells more.
/// @param plain  gathers at the probes without
CellTrial try_cells(const Probes& probes, const View& view, const RecordSettings& settings, const HitRadiance& radiance,
                    const LitScene& plain, double error)
{
    const GatherSize all{make_hemisphere_grid(settings.rays), 0};
    const double of_light = error_of_light(probes, Gatherer(plain, settings), all);
    if (of_light * of_light < kLeastOfLight * error * error) return {};
    const double most = std::max(kMostErrorOfCells, kMostPartOfCells * error);
    double samples = std::min(kMostSamples, kSamplesPerPixel * static_cast<double>(probes.gbuffer.size()));
    for (int more = 0;; ++more) {
        CellTrial trial{std::make_unique<DirectCells>(
            light_cells(plain.rays, radiance, probes.gbuffer, view, samples, settings.seed, probes.pool))};
        if (trial.cells->lights.empty()) return {};
        LitScene lit = plain;
        lit.direct = trial.cells.get();
        const Errors errors = gather_at(probes, Gatherer(lit, settings), all, 0, nullptr);
        trial.error = errors.all * std::pow(kKnowingRayCost, kStrataFall);
        if (trial.error * kLeastGainOfCells > error) return {};
        const double shared = error_of_cells(probes, plain, settings, all, *trial.cells);
        if (shared <= most) return trial;
        if (more > 0 || shared > most * std::sqrt(kMoreSamples)) return {};
        samples *= kMoreSamples;
    }
}

/// What all rays of a gather at each probe brought. @param light  becomes what they receive, that of gathered lamps too
GatherYield gather_once(const Probes& probes, const Gatherer& gatherer, const GatherSize& size, std::uint64_t sample,
                        std::vector<double>& light)
{
    light.resize(probes.pixels.size());
    return gather_each(
        gatherer, nullptr, probes.pixels.size(), size.cells(),
        [&](std::size_t k) {
            return GatherTask{birth_at(probes.gbuffer, probes.pixels[k], probes.seed, sample), &size};
        },
        probes.pool,
        [&](std::size_t k, const Record& record, const GatherWorkspace&) {
            light[k] = static_cast<double>(luminance(record.irradiance));
        });
}

float mean_light(std::span<const ArrivedRay> rays)
{
    double sum = 0.0;
    for (const ArrivedRay& ray : rays) sum += static_cast<double>(ray.light);
    return static_cast<float>(sum / static_cast<double>(std::max<std::size_t>(1, rays.size())));
}

/// Learns where light comes from at the probes, and whether rays that are aimed by that little leave no more noise:
/// records will know more. @return null: they do
std::unique_ptr<ArrivalMap> try_map(const Probes& probes, const View& view, const RecordSettings& settings,
                                    const LitScene& plain, const DirectCells* cells)
{
    const GatherSize all{make_hemisphere_grid(settings.rays), 0};
    const GatherSize half{make_hemisphere_grid(settings.rays / 2), 0, settings.rays - settings.rays / 2};
    const CellGrid grid = make_cell_grid(bounds_of(plain.rays.scene()), view);
    auto map = std::make_unique<ArrivalMap>(grid, 1.0f);
    const LitScene lit{plain.rays, plain.cache, nullptr, plain.gathered, nullptr, cells, map.get()};
    const Gatherer gatherer(lit, settings);
    Pairs pairs;
    pairs.errors.resize(probes.pixels.size());
    const GatherYield first = gather_once(probes, gatherer, all, 6, pairs.first);
    const GatherYield second = gather_once(probes, gatherer, all, 7, pairs.second);
    const double unaimed = errors_of(pairs).all;
    const float unit = mean_light(first.arrived);
    if (!(unit > 0.0f)) return nullptr;
    *map = ArrivalMap(grid, unit);
    for (const GatherYield* yield : {&first, &second}) map->learn(yield->gathers, yield->arrived, probes.pool);
    gather_once(probes, gatherer, half, 8, pairs.first);
    gather_once(probes, gatherer, half, 9, pairs.second);
    if (errors_of(pairs).all > unaimed) map.reset();
    return map;
}

Trial try_looks(const Probes& probes, const View& view, const RecordSettings& settings, const HitRadiance& radiance,
                const LitScene& plain, const Errors& errors)
{
    const GatherSize half{make_hemisphere_grid(settings.rays / 2), settings.rays - settings.rays / 2};
    const PlaceLight light{plain.rays, radiance, least_hit_alpha(settings.rays), nullptr};
    const auto survey = [&](double part) {
        return survey_light(light, probes.gbuffer, view, settings.seed, probes.pool, part);
    };
    const auto try_with = [&](const LightSurvey& surveyed, double points) {
        Trial trial{std::make_unique<GatherGuide>(surveyed, points, probes.pool), {}};
        if (!trial.guide->has_light()) return Trial{};
        LitScene lit = plain;
        lit.guide = trial.guide.get();
        const Gatherer guided(lit, settings);
        gather_at(probes, guided, half, 2, trial.guide.get());  // to learn who sees what
        trial.errors = gather_at(probes, guided, half, 4, trial.guide.get());
        const BestShare best = best_share(trial.errors, errors, settings.rays);
        trial.guide->share = best.share;
        trial.guide->gain = static_cast<float>(errors.all / best.error);
        trial.error = best.error;
        if (best.share == 0.0f) trial.guide.reset();
        return trial;
    };
    const auto pixels = static_cast<double>(probes.gbuffer.size());
    const double least = std::min(kLeastPoints, kMostPointsPerPixel * pixels);
    const double points = std::max(least, kPointsPerPixel * pixels);
    // A few points, and half a look around, tell whether looks do any good, if not yet how many it takes.
    const double few = std::max(least, kFewPoints * points);
    if (points > kManyMore * few && !try_with(survey(few / points), few).guide) return {};
    const LightSurvey surveyed = survey(1.0);
    Trial trial = try_with(surveyed, points);
    if (!trial.guide) return {};
    const double wanted = std::min(kMostMore, std::pow(trial.errors.points / kErrorOfPoints, 2.0)) * points;
    if (wanted < kHardlyMore * points) return trial;
    trial = try_with(surveyed, wanted);
    if (trial.errors.points > std::max(kMostErrorOfPoints, kMostPartOfPoints * errors.all)) return {};
    return trial;
}

}  // namespace

LightSearch search_light(const LitScene& scene, const GBuffer& gbuffer, const View& view,
                         const RecordSettings& settings, bool steady, ThreadPool& pool)
{
    if (settings.bounces == 0) return {};
    const LitScene plain{scene.rays, settings.bounces > 1 ? scene.cache : nullptr, nullptr, scene.gathered};
    const std::size_t trials = std::clamp(gbuffer.size() / kPixelsPerTrial, kFewestTrials, kMostTrials);
    const Probes probes{gbuffer, spread_pixels(gbuffer, trials, settings.seed), settings.seed, pool};
    const Errors errors =
        gather_at(probes, Gatherer(plain, settings), {make_hemisphere_grid(settings.rays), 0}, 0, nullptr);
    if (!(errors.all > 0.0)) return {};
    const HitRadiance radiance(scene.rays, nullptr, effects_or_scene(settings.effects, scene.rays), scene.gathered);
    Trial looks = try_looks(probes, view, settings, radiance, plain, errors);
    // Lit points are such knowledge as well, and what looks leave to rays is near: one or the other.
    CellTrial cells;
    if (steady && !(looks.guide && looks.error * kSureGain < errors.all))
        cells = try_cells(probes, view, settings, radiance, plain, errors.all);
    LightSearch found;
    if (cells.cells && (!looks.guide || cells.error < looks.error))
        found.direct = std::move(cells.cells);
    else
        found.guide = std::move(looks.guide);
    if (!found.guide) found.arrivals = try_map(probes, view, settings, plain, found.direct.get());
    return found;
}

}  // namespace rcs
