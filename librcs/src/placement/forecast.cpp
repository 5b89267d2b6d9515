#include "placement/forecast.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "accuracy/error_estimate.h"

namespace rcs {
namespace {

constexpr std::size_t kSample = 2048;    // of the records are enough
constexpr float kRaysOfRecord = 100.0f;  // finding its place takes as long as so many
constexpr float kBehindNoise = 0.4f;     // of the noise, spread that shows once that is gone
constexpr float kFallsShort = 0.85f;     // closer records leave more of the spread than planned: that to this power
constexpr double kLooks = 1.5;           // at the error, in each step
constexpr double kSharpening = 2.0;      // bringing records closer once takes as long as so many looks more
constexpr double kStalledStep = 0.98;    // of the error, left by a step: the last one
constexpr double kMostCome = 0.75;       // part of the way from an error to kStep of it that steps come in most scenes

/// The shares with the spread that is seen as long as there is their noise. @param shares  with all of it
std::vector<RecordShare> as_seen(const std::vector<RecordShare>& shares)
{
    std::vector<RecordShare> seen = shares;
    for (RecordShare& s : seen) {
        const float hidden = kBehindNoise * noise_of(s);
        s.spread = std::sqrt(std::max(0.0f, s.spread * s.spread - hidden * hidden));
    }
    return seen;
}

double mean_spread(const std::vector<RecordShare>& shares)
{
    double area = 0.0, spread = 0.0;
    for (const RecordShare& s : shares) {
        area += static_cast<double>(s.count * s.area);
        spread += static_cast<double>(s.count * s.area * s.spread);
    }
    return area > 0.0 ? kMeanAbsolute * spread / area : 0.0;
}

/// Puts new records among those that are there: together they have the noise of both. @return what the new ones cost,
/// in rays
double bring_closer(std::vector<RecordShare>& shares, const std::vector<float>& density, float gather)
{
    double rays = 0.0;
    for (std::size_t k = 0; k < shares.size(); ++k) {
        RecordShare& s = shares[k];
        const float old = 1.0f / density[k];
        const float noise = std::lerp(noise_with(s, std::min(gather, s.rays)), noise_of(s), old);
        rays += static_cast<double>(s.count * (density[k] - 1.0f) * (gather + kRaysOfRecord));
        s.spread *= std::pow(density[k], -kFallsShort * static_cast<float>(kSpreadFall));
        s.area *= old;
        s.count *= density[k];
        s.rays = noise > 0.0f ? std::pow(s.single / noise, 1.0f / s.fall) : s.rays;
    }
    return rays;
}

}  // namespace

std::vector<PathPoint> walk_ahead(std::vector<RecordShare> all, float gather, double progress, double least_error)
{
    const std::size_t stride = (all.size() + kSample - 1) / kSample;
    std::vector<RecordShare> shares;
    for (std::size_t k = 0; k < all.size(); k += stride) {
        RecordShare s = all[k];
        s.spread = std::hypot(s.spread, kBehindNoise * noise_of(s));
        shares.push_back(s);
    }
    const double scale = shares.empty() ? 1.0 : static_cast<double>(all.size()) / static_cast<double>(shares.size());
    const auto error = [&] { return allot(as_seen(shares), 0.0, kMostRays).error; };
    PathPoint at{error()};
    const double path_begin = at.error;
    std::vector<PathPoint> path{at};
    for (int step = 0; step < kMostSteps && at.error > least_error; ++step) {
        const double step_to = kStep * at.error, spread = mean_spread(as_seen(shares));
        if (spread > kShareOfSpread * step_to) {
            const double part = kShareOfSpread * step_to / spread;
            at.rays += scale * bring_closer(shares, densities(as_seen(shares), part, kMostDensity), gather);
            at.looks += kSharpening;
        }
        double so_far = 0.0;
        for (const RecordShare& s : shares) so_far += static_cast<double>(s.count * s.rays);
        const std::vector<RecordShare> seen = as_seen(shares);
        const double rays =
            std::clamp(allot_for_error(seen, step_to, kMostRays).rays, kLeastMore * so_far, kMostMore * so_far);
        const double level = allot_for_rays(seen, rays, kMostRays).level;
        for (RecordShare& s : shares) s.rays = rays_at(s, level, kMostRays);
        at.rays += scale * rays;
        at.looks += kLooks;
        const double then = error();
        const bool is_stalled = then > kStalledStep * at.error;
        at.error = std::min(at.error, then);
        if (is_stalled) break;
        path.push_back(at);
    }
    if (!(path_begin > 0.0)) return path;  // without light there is no error
    for (PathPoint& p : path) p.error = path_begin * std::pow(p.error / path_begin, progress);
    return path;
}

double progress_of_step(double left)
{
    // One step says half of it: the next ones are rarely as good or as bad.
    return std::clamp(std::sqrt(std::log(std::min(1.0, left)) / (kMostCome * std::log(kStep))), 0.75, 1.0);
}

PathPoint read_path(const std::vector<PathPoint>& path, double error)
{
    const auto to = std::find_if(path.begin(), path.end(), [&](const PathPoint& p) { return p.error <= error; });
    if (to == path.begin()) return {error};
    const auto of_noise = [](double e) { return std::pow(e, -1.0 / double{kNoiseFall}); };
    if (to == path.end()) {
        const PathPoint& last = path.back();
        const double more = of_noise(error) / of_noise(last.error);
        return {error, last.rays * more, last.looks + kLooks * std::log(last.error / error) / -std::log(kStep)};
    }
    const PathPoint& from = *(to - 1);
    const double part = (of_noise(error) - of_noise(from.error)) / (of_noise(to->error) - of_noise(from.error));
    return {error, std::lerp(from.rays, to->rays, part), to->looks};
}

}  // namespace rcs
