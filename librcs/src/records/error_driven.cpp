#include "records/error_driven.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace rcs {
namespace {

using Clock = std::chrono::steady_clock;

// Errors add up squared. What spread there is left costs records, noise costs rays: both about as the inverse square of
// the error, so that each gets about half.
constexpr double kShareOfSpread = 0.5, kShareOfNoise = 0.8;
constexpr double kSafety = 0.95;      // of the goal: an estimate scatters
constexpr double kMeanOfNoise = 0.8;  // mean relative error by noise, over what refine() is asked for
constexpr double kStep = 0.55;        // of the error, in one round: while records are noisy, their spread hides behind it
constexpr double kNearGoal = 1.2;     // times the goal: nearer, rays are the cheaper way
constexpr int kMostRounds = 12;
constexpr int kMostRays = 16384;      // per record
constexpr float kLeastScale = 0.5f;   // of a record's reach in one round
constexpr float kLeastReach = 4.0f;   // RecordOptions::min_reach [px]
constexpr double kLeastGoal = 1e-3;   // of a budget that could do more than anyone would see

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// How much shorter a record's reach has to be for the spread around it to become `goal`: the error of a first-order
/// expansion grows with the square of the distance.
float scale_for(float spread, double goal)
{
    const double wanted = std::sqrt(goal / std::max(1e-6, static_cast<double>(spread)));
    return static_cast<float>(std::clamp(wanted, static_cast<double>(kLeastScale), 1.0));
}

/// Spread around a record that needs no closer records where the mean error of all is to be `goal`.
double spread_target(double goal) { return kShareOfSpread * goal / 0.8; }

/// Noise around a record that needs no more rays where the mean error by noise is to be `goal`.
float noise_target(double goal) { return static_cast<float>(goal / kMeanOfNoise); }

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
    void sharpen(double goal);
    void refine(float target);
    double refining_seconds(float target) const
    {
        return seconds_per_ray_ * static_cast<double>(placement_.refining_rays(noise_, target, kMostRays));
    }
    float noise_within(double seconds) const;

    Placement& placement_;
    const View& view_;
    float tolerance_, overlap_;
    ThreadPool& pool_;
    const std::vector<Record>& records_;
    const RecordStats& stats_;
    SplatBuffer sums_;
    ErrorMap map_;
    MeanErrors errors_;
    std::vector<float> noise_;  // around each record
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
    look_seconds_ = seconds_since(start);
    noise_ = placement_.noise();
}

void Steering::overture()
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = stats_.hemisphere_rays;
    placement_.fill();
    seconds_per_ray_ = seconds_since(start) / static_cast<double>(std::max<std::uint64_t>(1, stats_.hemisphere_rays - before));
    look();
}

double Steering::seconds_to(double error) const
{
    const double wanted = kSafety * error;
    if (errors_.total <= wanted)
        return 0.0;
    double closer = 0.0;  // records
    if (errors_.spread > kShareOfSpread * wanted) {
        for (const std::uint32_t pixel : placement_.pixels()) {
            const float scale = scale_for(map_.spread[pixel], spread_target(wanted));
            closer += 1.0 / static_cast<double>(scale * scale) - 1.0;
        }
    }
    const double growth = 1.0 + closer / static_cast<double>(std::max<std::size_t>(1, placement_.pixels().size()));
    return growth * refining_seconds(noise_target(kShareOfNoise * wanted)) +
           closer * static_cast<double>(placement_.options().rays) * seconds_per_ray_;
}

/// Takes reach from the records whose extrapolations disagree, and fills what they no longer serve.
void Steering::sharpen(double goal)
{
    RecordOptions& options = placement_.options();
    const std::span<Record> records = placement_.records();
    bool any = false;
    for (std::size_t k = 0; k < records.size(); ++k) {
        const float scale = scale_for(map_.spread[placement_.pixels()[k]], spread_target(goal));
        if (scale >= 1.0f)
            continue;
        // Neighbours are held to the harmonic mean distance as well.
        records[k].harmonic_mean_distance = scale * records[k].spacing_radius / tolerance_;
        any = true;
    }
    if (!any)
        return;
    options.min_reach = std::max(std::min(kLeastReach, options.min_reach), 0.7f * options.min_reach);
    placement_.fill();
    look();
}

void Steering::refine(float target)
{
    const Clock::time_point start = Clock::now();
    const std::uint64_t before = stats_.hemisphere_rays;
    placement_.refine(noise_, target, kMostRays);
    placement_.options().noise_target = std::min(placement_.options().noise_target, target);
    const std::uint64_t rays = stats_.hemisphere_rays - before;
    if (rays > 0)
        seconds_per_ray_ = seconds_since(start) / static_cast<double>(rays);
}

/// The least noise whose rays fit into the time.
float Steering::noise_within(double seconds) const
{
    double low = kLeastGoal, high = 1.0;
    for (int step = 0; step < 16; ++step) {
        const double middle = std::sqrt(low * high);
        (refining_seconds(static_cast<float>(middle)) > seconds ? low : high) = middle;
    }
    return static_cast<float>(high);
}

void Steering::reach(const RecordGoal& goal)
{
    const Clock::time_point start = Clock::now();
    const double wanted = std::max(kLeastGoal, kSafety * goal.mean_relative);
    const auto left = [&] {
        return goal.seconds > 0.0 ? goal.seconds - seconds_since(start) : std::numeric_limits<double>::infinity();
    };
    double least = std::numeric_limits<double>::infinity();  // noise asked for so far
    for (int round = 0; round < kMostRounds && errors_.total > wanted; ++round) {
        const double aim = std::max(wanted, kStep * errors_.total);
        // Closer records take about as many rays again as there are, and have to be refined.
        const bool has_time = left() > 3.0 * look_seconds_ + refining_seconds(noise_target(aim));
        if (has_time && errors_.total > kNearGoal * wanted && errors_.spread > kShareOfSpread * aim) {
            sharpen(aim);
            least = std::numeric_limits<double>::infinity();
        }
        // The mean of both is more than the two means make, so by how much it is to fall counts, not what is left.
        const double fall = std::min(0.9, 0.95 * aim / errors_.total);
        least = std::min({kShareOfNoise * aim, fall * errors_.noise, fall * least});
        const float target = noise_target(least);
        const bool last = refining_seconds(target) + 2.0 * look_seconds_ > left();
        refine(last ? noise_within(left()) : target);
        if (last)
            break;
        look();
    }
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
