#include "placement/error_driven.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "placement/allotment.h"
#include "placement/forecast.h"
#include "placement/refine.h"
#include "rcs/metrics.h"
#include "splat/corrections.h"
#include "splat/gpu_records.h"
#include "util/color.h"

namespace rcs {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kNearGoal = 1.05;    // times the goal: nearer, rays alone are enough
constexpr double kHardlyLess = 0.95;  // times what it was: a step that does no more is the last of its kind
constexpr double kStalled = 0.995;    // times what it was, just before the goal
constexpr int kMostStalls = 2;
constexpr double kReached = 1.05;      // times the goal is there: estimates scatter as much
constexpr double kStillThere = 0.92;   // of the goal, with its margin, is there where it was
constexpr double kMostOfKnown = 0.15;  // rays of one step over all those of views before, which see to the rest
constexpr double kFewRays = 0.01;      // of those of the records that there were
constexpr double kMostFresh = 0.25;    // of the records: views before did not know those
constexpr int kMostRounds = 3;         // of the last step, each closer to its end
constexpr double kCloserTakes = 3.0;   // times as long in all: records at half the least distance
constexpr double kLeastForecast = 0.005;
constexpr double kLeastGoal = 1e-3;  // of a budget that could do more than anyone would see

/// In a larger picture the same reach in pixels is less of what is seen, and closer than an error asks for: an
/// overture's records have at least that part of its side, what 15 px are of 1000. (Sponza at 3840 x 2160 and 10 %: .82
/// of the processor time; with twice that part 1.5 times as much, since steps to closer records cost more.)
constexpr float kOvertureReach = 0.015f;

float side_of(const TiledSurfaces& picture)
{
    return std::sqrt(static_cast<float>(picture.width) * static_cast<float>(picture.height));
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// What one step may aim at and take.
struct StepLimits {
    double error = 0.0;   // mean relative: the goal, where it is nearer than a step
    double likely = 0.0;  // what the time is thought to be enough for
    bool has_budget = false;
    std::function<double()> left;  // [s]
    bool is_told = false;          // as RecordGoal has it
};

/// The work on one view's records, and what it costs.
class Steering {
public:
    Steering(Placement& placement, const std::optional<KnownError>& known, const View& view, float overlap,
             ThreadPool& pool, std::vector<Record>& records, const RecordStats& stats,
             const std::function<void(const RecordLook&)>& after_step)
        : placement_(placement),
          probes_(placement.make_probes()),
          known_(known),
          view_(view),
          tolerance_(placement.options().error_tolerance),
          overlap_(overlap),
          pool_(pool),
          records_(records),
          stats_(stats),
          handed_over_(placement.pixels().size()),
          made_before_(stats.records),
          after_step_(after_step)
    {
        for (const Record& r : std::as_const(placement).records()) taken_over_ += static_cast<double>(r.rays);
    }

    void overture(double most_seconds, double target);
    void reach(const RecordGoal& goal);

    RecordForecast forecast() const;

    /// What judged the error at the last look.
    Steered judged() { return {is_known() ? nullptr : std::move(probes_), scale_, seconds_per_ray_, errors_.total}; }

private:
    bool step(const StepLimits& to);
    void keep_noise();
    double rays_to(double error) const;
    std::uint64_t gathered() const { return stats_.hemisphere_rays + stats_.looks; }
    /// Whether what probes found of the views before is true of this one, whose records are mostly theirs.
    bool is_known() const
    {
        const auto fresh = static_cast<double>(stats_.records - made_before_ + stats_.renewed);
        return known_ && is_near_ && fresh < kMostFresh * static_cast<double>(records_.size());
    }
    void look();
    void tell() const
    {
        if (after_step_) after_step_({sums_, map_, scale_});
    }
    void note_seconds_per_ray(Clock::time_point start, std::uint64_t rays)
    {
        seconds_per_ray_ = seconds_since(start) / static_cast<double>(rays);
        least_per_ray_ = std::min(least_per_ray_, seconds_per_ray_);
    }
    void scale_shares(bool noise);
    std::vector<RecordShare> share_out() const;
    void sharpen(double part);
    void refine(const Allotment& allotment);
    void refine_fresh();
    void use_up(const std::function<double()>& left);
    double all_rays() const
    {
        return std::accumulate(shares_.begin(), shares_.end(), 0.0,
                               [](double sum, const RecordShare& s) { return sum + static_cast<double>(s.rays); });
    }
    Placement& placement_;
    std::unique_ptr<Probes> probes_;
    const std::optional<KnownError>& known_;  // from views before
    const View& view_;
    float tolerance_, overlap_;
    ThreadPool& pool_;
    std::vector<Record>& records_;
    const RecordStats& stats_;
    const std::size_t handed_over_;  // records of other views, the first of the placement's
    const std::uint64_t made_before_;
    const std::function<void(const RecordLook&)>& after_step_;
    double taken_over_ = 0.0;  // rays of records that other views gathered
    SplatBuffer sums_;
    ErrorMap map_;
    ErrorScale scale_;
    MeanErrors errors_;
    std::vector<RecordShare> shares_;  // of the placement's records
    float noise_scale_ = 1.0f;         // of the picture, over what the records' neighbours promise
    double seconds_per_ray_ = 0.0, look_seconds_ = 0.0;
    double least_per_ray_ = std::numeric_limits<double>::infinity(),
           least_look_ = least_per_ray_;  // without what else the machine did
    double progress_ = 1.0;               // for walk_ahead()
    bool is_near_ = true;                 // the goal is: no farther than a step that makes other records of them
    int steps_ = 0;
    int stalls_ = 0;  // steps in a row that did not lower the error: what hid behind noise may come to light in one
};

/// The errors of the records as they are now.
void Steering::look()
{
    const Clock::time_point start = Clock::now();
    SplatStats stats;
    set_corrections(records_, {tolerance_, overlap_}, pool_);
    sums_ = splat_tiles(records_, placement_.surfaces(), view_, {tolerance_, overlap_}, pool_, stats);
    map_ = error_map(sums_, stats, overlap_, pool_);
    if (is_known()) {
        scale_ = known_->scale;
    } else {
        probes_->spend(Probes::worth(taken_over_ + static_cast<double>(gathered())), sums_, map_);
        scale_ = probes_->compare(sums_, map_);
    }
    scale(map_, scale_, pool_);
    errors_ = mean_errors(sums_, map_, scale_, pool_);
    shares_ = share_out();
    look_seconds_ = seconds_since(start);
    least_look_ = std::min(least_look_, look_seconds_);
}

/// Makes the shares' mean errors those of the picture. @param noise  that as well: rays are as allotted
void Steering::scale_shares(bool noise)
{
    double area = 0.0, by_noise = 0.0, by_spread = 0.0;
    for (const RecordShare& s : shares_) {
        area += static_cast<double>(s.area);
        by_noise += static_cast<double>(s.area * noise_of(s));
        by_spread += static_cast<double>(s.area * s.spread);
    }
    if (noise && by_noise > 0.0) noise_scale_ = static_cast<float>(errors_.noise / kMeanAbsolute * area / by_noise);
    const float spread_scale =
        by_spread > 0.0 ? static_cast<float>(errors_.spread / kMeanAbsolute * area / by_spread) : 1.0f;
    for (RecordShare& s : shares_) {
        s.single *= noise_scale_;
        s.spread *= spread_scale;
    }
}

std::vector<RecordShare> Steering::share_out() const
{
    const std::vector<float> around = placement_.noise();
    const std::span<const Record> records = std::as_const(placement_).records();
    const float to_single = std::pow(static_cast<float>(placement_.rays()), placement_.noise_fall());
    const float dark = static_cast<float>(kRelativeErrorFloor * errors_.mean);
    std::vector<RecordShare> shares(records.size());
    for (std::size_t k = 0; k < shares.size(); ++k) {
        const std::uint32_t pixel = placement_.pixels()[k];
        const Record& r = records[k];
        // The weight of one splat is a cone; where all that overlap add up to W, a record makes 1 / W of its pixels.
        const float radius = influence_radius(r, overlap_) / r.footprint;
        const float light = luminance({sums_.weighted_r[pixel], sums_.weighted_g[pixel], sums_.weighted_b[pixel]});
        const float seen = light > 0.0f ? light / (light + dark * sums_.weight[pixel]) : 0.0f;
        shares[k].area = seen * std::numbers::pi_v<float> / 3.0f * radius * radius / sums_.weight[pixel];
        shares[k].single = to_single * around[k];
        shares[k].spread = map_.spread[pixel];
        shares[k].rays = static_cast<float>(r.rays);
        shares[k].fall = placement_.noise_fall();
    }
    return shares;
}

/// Coarse records that serve every pixel, and the first step down from there where it is a part of the way only: it
/// shows what rays cost and what hides behind their noise. @param target  0: a budget, of which this may take
/// `most_seconds`
void Steering::overture(double most_seconds, double target)
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = gathered();
    float& reach = placement_.options().min_reach;
    const float larger = std::max(1.0f, kOvertureReach * side_of(placement_.surfaces()) / reach);
    reach *= larger;
    placement_.options().max_reach *= larger;
    const float closest = reach;
    // Where they must lie closer the error shows: at 5 % that is cheaper than to have them so wherever light is steep.
    placement_.options().steepest = 1.0f;
    // Records that views before brought to a goal lie closer already.
    if (most_seconds > 0.0 && (handed_over_ == 0 || !is_known())) reach = placement_.options().max_reach;
    placement_.fill();
    while (reach > closest && kCloserTakes * seconds_since(start) < most_seconds) {
        reach = std::max(closest, 0.5f * reach);
        placement_.fill();
    }
    refine_fresh();
    // A few say little of what many take.
    if (const std::uint64_t rays = gathered() - before; known_ && static_cast<double>(rays) < kFewRays * taken_over_)
        seconds_per_ray_ = least_per_ray_ = known_->seconds_per_ray;
    else
        note_seconds_per_ray(start, std::max<std::uint64_t>(1, rays));
    look();
    scale_shares(true);
    tell();
    const double error = kStep * errors_.total;
    const bool is_near = target > 0.0 ? error < kShareOfGoal * target
                                      : seconds_since(start) + 2.0 * rays_to(error) * seconds_per_ray_ > most_seconds;
    if (!is_near) step({0.0, 0.0, false, [] { return std::numeric_limits<double>::infinity(); }});
}

/// Rays of a step to that error.
double Steering::rays_to(double error) const
{
    const double all = all_rays(), most = is_known() ? kMostOfKnown : kMostMore;
    return std::clamp(allot_for_error(shares_, error, kMostRays).rays, kLeastMore * all, most * all);
}

RecordForecast Steering::forecast() const
{
    return {sums_, map_, scale_, look_seconds_,
            [path = walk_ahead(shares_, static_cast<float>(placement_.rays()), progress_, kLeastForecast),
             per_ray = least_per_ray_, look = least_look_,
             there = is_known() ? errors_.total / kStillThere : std::numeric_limits<double>::infinity()](double error) {
                if (error > there) return 0.0;
                const PathPoint to = read_path(path, kShareOfGoal * error);
                return to.rays * per_ray + to.looks * look;
            }};
}

/// Brings the mean error by spread down to `part` of what it is: takes reach from records whose extrapolations
/// disagree, and fills what they no longer serve; where records lie as close as they may, the splat takes fewer of them
/// together.
void Steering::sharpen(double part)
{
    const std::vector<float> density = densities(shares_, part, kMostDensity);
    const std::span<Record> records = placement_.records();
    const float least = std::min(kLeastReach, placement_.options().min_reach);  // [px]
    for (std::size_t k = 0; k < records.size(); ++k) {
        if (!(density[k] > 1.0f) || placement_.bring_closer(k, density[k], least)) continue;
        records[k].breadth = std::max(1.0f / overlap_, records[k].breadth / std::sqrt(density[k]));
    }
    placement_.fill();
    refine_fresh();
    look();
    scale_shares(false);
}

/// Among records that other views have brought down to the goal, new ones are to be no noisier than those.
void Steering::refine_fresh()
{
    if (!is_known()) return;
    const RecordSettings& settings = placement_.options();
    const float widest = settings.error_tolerance * settings.max_reach;
    std::vector<int> extra = extra_gathers(std::as_const(placement_).records(), placement_.noise(), placement_.rays(),
                                           known_->noise, widest, static_cast<int>(kMostRays));
    std::fill_n(extra.begin(), handed_over_, 0);
    placement_.refine(extra);
}

void Steering::refine(const Allotment& allotment)
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = gathered();
    const float gather = static_cast<float>(placement_.rays());
    std::vector<int> extra;
    extra.reserve(shares_.size());
    for (const RecordShare& s : shares_)
        extra.push_back(static_cast<int>(std::lround((rays_at(s, allotment.level, kMostRays) - s.rays) / gather)));
    placement_.refine(extra);
    for (std::size_t k = 0; k < shares_.size(); ++k) shares_[k].rays += static_cast<float>(extra[k]) * gather;
    const std::uint64_t rays = gathered() - before;
    if (rays > 0) note_seconds_per_ray(start, rays);
}

/// Shoots rays for as long as there is time; how fast they are shows while they are shot.
void Steering::use_up(const std::function<double()>& left)
{
    for (int round = 0; round < kMostRounds && left() > look_seconds_ / kMostRounds; ++round)
        refine(allot_for_rays(shares_, left() / seconds_per_ray_, kMostRays));
}

/// One step down: records closer together where spread asks for it, then rays. @return whether another one is worth it
bool Steering::step(const StepLimits& to)
{
    const double before = errors_.total, step_to = kStep * before, end = std::max(to.error, step_to);
    const bool is_cut = to.error > step_to;
    // Spread hides behind noise, and shows more of itself from step to step.
    for (int k = 0; k < kMostSharpenings && before > kNearGoal * to.error && errors_.spread > kShareOfSpread * end;
         ++k) {
        // Closer records than the time is enough for would only be noisy ones, but where noise is the lesser part.
        const bool is_noisy = errors_.noise > errors_.spread;
        if (to.left() < 4.0 * look_seconds_ || (step_to < to.likely && stalls_ == 0 && is_noisy)) break;
        const double spread = errors_.spread;
        sharpen(kShareOfSpread * end / spread);
        if (errors_.total <= to.error) return false;
        if (errors_.spread > kHardlyLess * spread) break;
    }
    is_near_ = is_near_ && (to.has_budget || kStep * errors_.total < to.error);
    const double rays = rays_to(end);
    const bool is_last =
        rays * seconds_per_ray_ + 2.0 * look_seconds_ > to.left() || (to.has_budget && steps_ + 1 == kMostSteps);
    if (is_last) {
        use_up(to.left);
        if (to.is_told) look();
        return false;
    }
    is_near_ = is_near_ && !to.has_budget;  // how near that is nobody knows
    refine(allot_for_rays(shares_, rays, kMostRays));
    look();
    scale_shares(true);
    tell();
    progress_ = progress_of_step(errors_.total / before);
    ++steps_;
    stalls_ = errors_.total > (is_cut ? kStalled : kHardlyLess) * before ? stalls_ + 1 : 0;
    return stalls_ < kMostStalls || to.has_budget;
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
    const StepLimits limits{wanted, goal.likely, goal.seconds > 0.0, left, goal.is_told};
    // Records that other views brought there stay as they are until the error is surely too large: what changes from
    // view to view is seen.
    if (is_known() && errors_.total < kStillThere * goal.mean_relative) return keep_noise();
    while (steps_ < kMostSteps && errors_.total > kReached * wanted && step(limits)) {
    }
    keep_noise();
}

/// Further views' records are judged one by one.
void Steering::keep_noise()
{
    placement_.options().noise_target = static_cast<float>(std::max(kLeastGoal, errors_.noise / kMeanAbsolute));
}

}  // namespace

Steered place_to_goal(Placement& placement, const View& view, float overlap, const Overture& overture, ThreadPool& pool,
                      std::vector<Record>& records, RecordStats& stats, const SteeringHooks& hooks)
{
    placement.take_over();
    Steering steering(placement, overture.known, view, overlap, pool, records, stats, hooks.after_step);
    steering.overture(overture.seconds, overture.target);
    if (const std::optional<RecordGoal> goal = hooks.set_goal(steering.forecast())) steering.reach(*goal);
    return steering.judged();
}

}  // namespace rcs
