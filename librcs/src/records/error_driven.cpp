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
#include "splat/gpu_records.h"
#include "util/color.h"

namespace rcs {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kStep = 0.7;            // of the error, from one look at it to the next
constexpr double kShareOfSpread = 0.6;   // of the error: errors add up squared, and rays show more of it
constexpr double kNearGoal = 1.05;       // times the goal: nearer, rays alone are enough
constexpr float kHardlyMore = 1.05f;     // times the closest spacing: as close as they may
constexpr double kHardlyLess = 0.95;     // times what it was: a step that does no more is the last of its kind
constexpr float kRaysOfRecord = 100.0f;  // finding its place takes as long as so many
constexpr std::size_t kPlanned = 8192;   // of the records are enough to plan by
constexpr double kStalled = 0.995;       // times what it was, just before the goal
constexpr double kMostMore = 4.0;        // rays of one step, over those so far
constexpr double kLeastMore = 0.05;      // the same: the last step to the goal may promise to take next to none
constexpr double kReached = 1.01;        // times the goal is there
constexpr int kMostSharpenings = 3;      // in a step
constexpr int kMostSteps = 24;
constexpr int kMostRounds = 3;           // of the last step, each closer to its end
constexpr float kMostRays = 16384.0f;    // per record
constexpr float kMostDensity = 4.0f;     // of records in one round, over what it was
constexpr float kMostForecast = 64.0f;   // ... in a forecast, in all
constexpr double kCloserTakes = 3.0;     // times as long in all: records at half the least distance
constexpr double kLooks = 1.5;           // at the error, in each step
constexpr float kBehindNoise = 0.3f;     // of the noise, spread that shows once that is gone
constexpr double kSharpening = 4.0;      // steps that bring records closer take as long as so many looks more
constexpr float kLeastReach = 4.0f;      // least R_k of a record whose expansion disagrees with the others [px]
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

    void overture(double most_seconds);
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
    void sharpen(double part);
    void refine(const Allotment& allotment);
    void use_up(const std::function<double()>& left);
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
        const float radius = influence_radius(r, overlap_) / r.footprint;
        const float light = luminance({sums_.weighted_r[pixel], sums_.weighted_g[pixel], sums_.weighted_b[pixel]});
        const float seen = light / (light + dark * sums_.weight[pixel]);
        shares[k].area = seen * std::numbers::pi_v<float> / 3.0f * radius * radius / sums_.weight[pixel];
        shares[k].single = to_single * around[k];
        shares[k].spread = map_.spread[pixel];
        shares[k].rays = static_cast<float>(r.rays);
    }
    return shares;
}

void Steering::overture(double most_seconds)
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = stats_.hemisphere_rays;
    float& reach = placement_.options().min_reach;
    const float closest = reach;
    if (most_seconds > 0.0)
        reach = placement_.options().max_reach;
    placement_.fill();
    while (reach > closest && kCloserTakes * seconds_since(start) < most_seconds) {
        reach = std::max(closest, 0.5f * reach);
        placement_.fill();
    }
    seconds_per_ray_ = seconds_since(start) / static_cast<double>(std::max<std::uint64_t>(1, stats_.hemisphere_rays - before));
    look();
    scale_shares(true);
}

double Steering::seconds_to(double error) const
{
    const double wanted = kShareOfGoal * error;
    if (errors_.total <= wanted)
        return 0.0;
    // Some of the records say enough.
    const std::size_t stride = (shares_.size() + kPlanned - 1) / kPlanned;
    std::vector<RecordShare> shares;
    for (std::size_t k = 0; k < shares_.size(); k += stride)
        shares.push_back(shares_[k]);
    double seen = 0.0, all = 0.0;
    for (RecordShare& s : shares) {
        seen += static_cast<double>(s.area * s.spread);
        s.spread = std::hypot(s.spread, kBehindNoise * s.single / std::sqrt(s.rays));
        all += static_cast<double>(s.area * s.spread);
    }
    const double spread = seen > 0.0 ? errors_.spread * all / seen : 0.0;
    const double part = kShareOfSpread * wanted / std::max(spread, 1e-9);
    const std::vector<float> density = densities(shares, part, kMostForecast);
    double rays = 0.0;  // of closer records: they gather from scratch, and each makes a smaller part of the picture
    for (std::size_t k = 0; k < shares.size(); ++k) {
        RecordShare& s = shares[k];
        s.spread = spread_at(s, density[k]);
        s.area /= density[k];
        s.count = density[k];
        rays += static_cast<double>((density[k] - 1.0f) * (s.rays + kRaysOfRecord));
    }
    rays += allot_for_error(shares, wanted, std::numeric_limits<float>::infinity()).rays;
    rays *= static_cast<double>(shares_.size()) / static_cast<double>(shares.size());
    const double steps = std::ceil(std::log(wanted / errors_.total) / std::log(kStep));
    const double sharpenings = part < 1.0 ? std::min(steps, 1.0 + std::ceil(std::log(part) / std::log(kStep))) : 0.0;
    return rays * seconds_per_ray_ + (kLooks * steps + kSharpening * sharpenings) * look_seconds_;
}

/// Brings the mean error by spread down to `part` of what it is: takes reach from records whose extrapolations disagree, and
/// fills what they no longer serve; where records lie as close as they may, the splat takes fewer of them together.
void Steering::sharpen(double part)
{
    const std::vector<float> density = densities(shares_, part, kMostDensity);
    const std::span<Record> records = placement_.records();
    const float least = std::min(kLeastReach, placement_.options().min_reach);  // [px]
    for (std::size_t k = 0; k < records.size(); ++k) {
        Record& r = records[k];
        if (!(density[k] > 1.0f))
            continue;
        const float nearer = 1.0f / std::sqrt(density[k]);
        const float reach = r.spacing_radius / tolerance_;
        if (reach > kHardlyMore * least * r.footprint) {
            r.harmonic_mean_distance = nearer * reach;  // neighbours are held to it as well
            placement_.allow_closer(k, std::max(least, nearer * reach / r.footprint));
        } else
            r.breadth = std::max(1.0f / overlap_, nearer * r.breadth);
    }
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
    for (std::size_t k = 0; k < shares_.size(); ++k)
        shares_[k].rays += static_cast<float>(extra[k]) * gather;
    const std::uint64_t rays = stats_.hemisphere_rays - before;
    if (rays > 0)
        seconds_per_ray_ = seconds_since(start) / static_cast<double>(rays);
}

/// Shoots rays for as long as there is time; how fast they are shows while they are shot.
void Steering::use_up(const std::function<double()>& left)
{
    for (int round = 0; round < kMostRounds && left() > look_seconds_ / kMostRounds; ++round)
        refine(allot_for_rays(shares_, left() / seconds_per_ray_, kMostRays));
}

/// Goes down steps that are the same for every goal; only the last one is cut short, to end at the goal itself. So a
/// smaller goal takes all that a larger one does, and more.
void Steering::reach(const RecordGoal& goal)
{
    const Clock::time_point start = Clock::now();
    const double wanted = std::max(kLeastGoal, kShareOfGoal * goal.mean_relative);
    const auto left = [&] {
        return goal.seconds > 0.0 ? goal.seconds - goal.looks_after * look_seconds_ - seconds_since(start)
                                  : std::numeric_limits<double>::infinity();
    };
    const bool has_budget = goal.seconds > 0.0;
    bool is_stalled = false;  // rays alone lower the error no more
    for (int step = 0; step < kMostSteps && errors_.total > kReached * wanted; ++step) {
        const double before = errors_.total, step_to = kStep * before;
        const bool is_cut = wanted > step_to;
        const double aim = std::max(wanted, step_to);
        // Spread hides behind noise, and shows more of itself from step to step.
        for (int k = 0; k < kMostSharpenings && before > kNearGoal * wanted && errors_.spread > kShareOfSpread * step_to; ++k) {
            // Closer records than the time is enough for would only be noisy ones.
            if (left() < 4.0 * look_seconds_ || (step_to < goal.likely && !is_stalled))
                break;
            const double spread = errors_.spread, part = kShareOfSpread * step_to / spread;
            sharpen(part);
            if (errors_.spread > kHardlyLess * spread)
                break;
        }
        const double rays = std::clamp(allot_for_error(shares_, aim, kMostRays).rays, kLeastMore * all_rays(),
                                 kMostMore * all_rays());
        const bool is_last = rays * seconds_per_ray_ + 2.0 * look_seconds_ > left() || (has_budget && step + 1 == kMostSteps);
        if (is_last) {
            use_up(left);
            break;
        }
        refine(allot_for_rays(shares_, rays, kMostRays));
        look();
        scale_shares(true);
        is_stalled = errors_.total > (is_cut ? kStalled : kHardlyLess) * before;
        if (is_stalled && !has_budget)
            break;
    }
    // Further views' records are judged one by one.
    placement_.options().noise_target = static_cast<float>(std::max(kLeastGoal, errors_.noise / kMeanAbsolute));
}

}  // namespace

MeanErrors place_to_goal(Placement& placement, const View& view, float overlap, double overture_seconds, ThreadPool& pool,
                         std::vector<Record>& records, RecordStats& stats,
                         const std::function<std::optional<RecordGoal>(const RecordForecast&)>& set_goal)
{
    Steering steering(placement, view, overlap, pool, records, stats);
    steering.overture(overture_seconds);
    if (const std::optional<RecordGoal> goal = set_goal(steering.forecast()))
        steering.reach(*goal);
    return steering.errors();
}

}  // namespace rcs
