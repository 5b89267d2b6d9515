#include "records/error_driven.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "rcs/metrics.h"
#include "records/allotment.h"
#include "util/color.h"

namespace rcs {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSafety = 0.95;         // of the goal: an estimate scatters
constexpr double kStep = 0.75;           // of the error, from one look at it to the next
constexpr double kShareOfSpread = 0.45;  // of the error: errors add up squared, and rays show more of it
constexpr double kNearGoal = 1.05;       // times the goal: nearer, rays alone are enough
constexpr double kHardlyLess = 0.97;     // times what it was: a step that does no more is the last of its kind
constexpr double kMostMore = 4.0;        // rays of one step, over those so far
constexpr int kMostSharpenings = 4;      // in a step
constexpr int kMostSteps = 24;
constexpr float kMostRays = 16384.0f;    // per record
constexpr float kMostDensity = 4.0f;     // of records in one round, over what it was
constexpr float kMostForecast = 64.0f;   // ... in a forecast, in all
constexpr double kLooks = 2.5;           // at the error, in each step
constexpr float kLeastReach = 4.0f;      // RecordOptions::min_reach [px]
constexpr double kLeastGoal = 1e-3;      // of a budget that could do more than anyone would see

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The work on one view's records, and what it costs.
class Steering {
public:
    Steering(Placement& placement, const View& view, float overlap, ThreadPool& pool, const std::vector<Record>& records,
             const RecordStats& stats)
        : placement_(placement), view_(view), tolerance_(placement.options().error_tolerance), overlap_(overlap), pool_(pool),
          records_(records), stats_(stats)
    {
    }

    void overture();
    double seconds_to(double error) const;
    void reach(const RecordGoal& goal);

    RecordForecast forecast() const
    {
        return {sums_, map_, look_seconds_, [this](double error) { return seconds_to(error); }};
    }
    const MeanErrors& errors() const { return errors_; }

private:
    void look();
    void scale_shares(bool noise);
    std::vector<RecordShare> share_out() const;
    void sharpen(double spread);
    void refine(const Allotment& allotment);
    double all_rays() const
    {
        return std::accumulate(shares_.begin(), shares_.end(), 0.0,
                               [](double sum, const RecordShare& s) { return sum + static_cast<double>(s.rays); });
    }
    Placement& placement_;
    const View& view_;
    float tolerance_, overlap_;
    ThreadPool& pool_;
    const std::vector<Record>& records_;
    const RecordStats& stats_;
    SplatBuffer sums_;
    ErrorMap map_;
    MeanErrors errors_;
    std::vector<RecordShare> shares_;  // of the placement's records
    float noise_scale_ = 1.0f;         // of the picture, over what the records' neighbours promise
    double seconds_per_ray_ = 0.0, look_seconds_ = 0.0;
};

/// The errors of the records as they are now.
void Steering::look()
{
    const Clock::time_point start = Clock::now();
    SplatStats stats;
    sums_ = splat_tiles(records_, placement_.surfaces(), view_, {tolerance_, overlap_}, pool_, stats);
    map_ = error_map(sums_, stats, overlap_);
    errors_ = mean_errors(sums_, map_);
    shares_ = share_out();
    look_seconds_ = seconds_since(start);
}

/// Makes the shares' mean errors those of the picture. @param noise  that as well: rays are as allotted
void Steering::scale_shares(bool noise)
{
    double area = 0.0, by_noise = 0.0, by_spread = 0.0;
    for (const RecordShare& s : shares_) {
        area += static_cast<double>(s.area);
        by_noise += static_cast<double>(s.area * s.single / std::sqrt(s.rays));
        by_spread += static_cast<double>(s.area * s.spread);
    }
    if (noise && by_noise > 0.0)
        noise_scale_ = static_cast<float>(errors_.noise / kMeanAbsolute * area / by_noise);
    const float spread_scale = by_spread > 0.0 ? static_cast<float>(errors_.spread / kMeanAbsolute * area / by_spread) : 1.0f;
    for (RecordShare& s : shares_) {
        s.single *= noise_scale_;
        s.spread *= spread_scale;
    }
}

std::vector<RecordShare> Steering::share_out() const
{
    const std::vector<float> around = placement_.noise();
    const std::span<const Record> records = std::as_const(placement_).records();
    const float to_single = std::sqrt(static_cast<float>(placement_.rays()));
    const float dark = static_cast<float>(kRelativeErrorFloor * errors_.mean);
    std::vector<RecordShare> shares(records.size());
    for (std::size_t k = 0; k < shares.size(); ++k) {
        const std::uint32_t pixel = placement_.pixels()[k];
        const Record& r = records[k];
        // The weight of one splat is a cone; where all that overlap add up to W, a record makes 1 / W of its pixels.
        const float radius = overlap_ * r.spacing_radius / r.footprint;
        const float light = luminance({sums_.weighted_r[pixel], sums_.weighted_g[pixel], sums_.weighted_b[pixel]});
        const float seen = light / (light + dark * sums_.weight[pixel]);
        shares[k].area = seen * std::numbers::pi_v<float> / 3.0f * radius * radius / sums_.weight[pixel];
        shares[k].single = to_single * around[k];
        shares[k].spread = map_.spread[pixel];
        shares[k].rays = static_cast<float>(r.rays);
    }
    return shares;
}

void Steering::overture()
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = stats_.hemisphere_rays;
    placement_.fill();
    seconds_per_ray_ = seconds_since(start) / static_cast<double>(std::max<std::uint64_t>(1, stats_.hemisphere_rays - before));
    look();
    scale_shares(true);
}

double Steering::seconds_to(double error) const
{
    const double wanted = kSafety * error;
    if (errors_.total <= wanted)
        return 0.0;
    std::vector<RecordShare> shares;
    double rays = 0.0;  // of closer records: they gather from scratch, and each makes a smaller part of the picture
    const double part = kShareOfSpread * wanted / std::max(errors_.spread, 1e-9);
    const std::vector<float> density = densities(shares_, part, kMostForecast);
    for (std::size_t k = 0; k < shares_.size(); ++k) {
        RecordShare s = shares_[k];
        const float count = std::round(density[k]);
        s.area /= count;
        s.spread /= density[k];
        rays += static_cast<double>((count - 1.0f) * s.rays);
        shares.insert(shares.end(), static_cast<std::size_t>(count), s);
    }
    rays += allot_for_error(shares, wanted, std::numeric_limits<float>::infinity()).rays;
    const double steps = std::ceil(std::log(wanted / errors_.total) / std::log(kStep));
    return rays * seconds_per_ray_ + kLooks * steps * look_seconds_;
}

/// Takes reach from the records whose extrapolations disagree, and fills what they no longer serve, so that the mean
/// error by spread comes down to `spread`.
void Steering::sharpen(double spread)
{
    const std::vector<float> density = densities(shares_, spread / errors_.spread, kMostDensity);
    RecordOptions& options = placement_.options();
    const std::span<Record> records = placement_.records();
    for (std::size_t k = 0; k < records.size(); ++k)
        // Neighbours are held to the harmonic mean distance as well.
        if (density[k] > 1.0f)
            records[k].harmonic_mean_distance = records[k].spacing_radius / (tolerance_ * std::sqrt(density[k]));
    options.min_reach = std::max(std::min(kLeastReach, options.min_reach), 0.7f * options.min_reach);
    placement_.fill();
    look();
    scale_shares(false);
}

void Steering::refine(const Allotment& allotment)
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = stats_.hemisphere_rays;
    const float gather = static_cast<float>(placement_.rays());
    std::vector<int> extra;
    extra.reserve(shares_.size());
    for (const RecordShare& s : shares_)
        extra.push_back(static_cast<int>(std::lround((rays_at(s, allotment.level, kMostRays) - s.rays) / gather)));
    placement_.refine(extra);
    const std::uint64_t rays = stats_.hemisphere_rays - before;
    if (rays > 0)
        seconds_per_ray_ = seconds_since(start) / static_cast<double>(rays);
}

/// Goes down steps that are the same for every goal; only the last one is cut short, to end at the goal itself. So a
/// smaller goal takes all that a larger one does, and more.
void Steering::reach(const RecordGoal& goal)
{
    const Clock::time_point start = Clock::now();
    const double wanted = std::max(kLeastGoal, kSafety * goal.mean_relative);
    const auto left = [&] {
        return goal.seconds > 0.0 ? goal.seconds - seconds_since(start) : std::numeric_limits<double>::infinity();
    };
    for (int step = 0; step < kMostSteps && errors_.total > wanted; ++step) {
        const double before = errors_.total, step_to = kStep * before;
        const bool is_cut = wanted > step_to;
        // Spread hides behind noise, and shows more of itself from step to step.
        for (int k = 0; k < kMostSharpenings && before > kNearGoal * wanted && errors_.spread > kShareOfSpread * step_to; ++k) {
            // Closer records than the time is enough for would only be noisy ones.
            if (left() < 4.0 * look_seconds_ || step_to < goal.likely)
                break;
            const double spread = errors_.spread;
            sharpen(kShareOfSpread * step_to);
            if (errors_.spread > kHardlyLess * spread)
                break;
        }
        double rays = std::min(allot_for_error(shares_, std::max(wanted, step_to), kMostRays).rays, kMostMore * all_rays());
        const bool is_last = rays * seconds_per_ray_ + 2.0 * look_seconds_ > left();
        if (is_last)
            rays = std::max(0.0, left()) / seconds_per_ray_;
        refine(allot_for_rays(shares_, rays, kMostRays));
        if (is_last)
            break;
        look();
        scale_shares(true);
        if (!is_cut && errors_.total > kHardlyLess * before)
            break;
    }
    // Further views' records are judged one by one.
    placement_.options().noise_target = static_cast<float>(std::max(kLeastGoal, errors_.noise / kMeanAbsolute));
}

}  // namespace

MeanErrors place_to_goal(Placement& placement, const View& view, float overlap, ThreadPool& pool,
                         std::vector<Record>& records, RecordStats& stats,
                         const std::function<std::optional<RecordGoal>(const RecordForecast&)>& set_goal)
{
    Steering steering(placement, view, overlap, pool, records, stats);
    steering.overture();
    if (const std::optional<RecordGoal> goal = set_goal(steering.forecast()))
        steering.reach(*goal);
    return steering.errors();
}

}  // namespace rcs
