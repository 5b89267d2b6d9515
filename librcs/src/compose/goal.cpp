#include "compose/goal.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "direct/direct.h"
#include "radiance/lobes.h"
#include "rcs/error.h"

namespace rcs {
namespace {

// Of the time that a budget leaves, what passes beyond the first may take.
constexpr double kMostForPasses = 0.4;
// ... and what direct light of the first may, which takes so many times what it does without penumbras.
constexpr double kMostForDirect = 0.25;
constexpr double kWithPenumbras = 2.0;
// ... and the first records, as far as they can be fewer.
constexpr double kMostForOverture = 0.4;
// A splat that lights glossy surfaces takes so many times as long as a look at the error: 2.1 to 2.9 in castle, sponza
// and sibenik, 1000x1000; more with smaller pictures.
constexpr double kSplatWithLobes = 3.4;
constexpr int kMostLobeRounds = 64;
// Errors of lobes and records are in different pixels, for the most part: so much of one is added to the other.
constexpr double kLobesAdd = 0.8;

constexpr double kForecastErrors[] = {0.2, 0.1, 0.05, 0.03, 0.02, 0.01};

double seconds_of(const RenderStats& stats, const char* stage)
{
    for (const auto& [name, seconds] : stats.stage_seconds)
        if (name == stage) return seconds;
    return 0.0;
}

/// Part of the pixels whose lobes records light.
double part_with_lobes(const FirstView& first)
{
    const std::size_t pixels = first.gbuffer.size();
    if (!first.has_lobes || !first.shading.has_lobes() || pixels == 0) return 0.0;
    std::size_t lit = 0;
    for (std::size_t i = 0; i < pixels; ++i) lit += first.shading.recorded(i) ? 1 : 0;
    return static_cast<double>(lit) / static_cast<double>(pixels);
}

/// What follows the first view's records, in looks at the error: each view is splatted, its error estimated, its layers
/// added up; further ones are searched for holes as well.
double looks_after(int passes, double lobes)
{
    return passes * (std::lerp(1.0, kSplatWithLobes, lobes) + 0.5) + (passes - 1) * 2.0;
}

/// The smallest error that takes no more than `seconds`.
template <typename SecondsTo>
double error_within(const SecondsTo& seconds_to, double seconds)
{
    double low = 1e-3, high = 1.0;
    for (int step = 0; step < 20; ++step) {
        const double middle = std::sqrt(low * high);
        (seconds_to(middle) > seconds ? low : high) = middle;
    }
    return high;
}

}  // namespace

Goal::Goal(const RenderOptions& options)
    : options_(options), start_(std::chrono::steady_clock::now()), passes_(options.aa)
{
}

double Goal::elapsed() const
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

bool Goal::wants_pass(int done)
{
    if (budget_seconds(options_) > 0.0 && done > 0) {
        const double now = elapsed(), left = budget_seconds(options_) - now;
        if (done > 1) pass_seconds_ = now - pass_ended_;
        pass_ended_ = now;
        // One that would end too late by more than there is left is left out, one that fits is added.
        if (done < passes_ ? pass_seconds_ > 2.0 * left : pass_seconds_ > left)
            passes_ = done;
        else
            passes_ = std::min(std::max(passes_, done + 1), options_.aa);
    }
    return done < passes_;
}

DirectSettings Goal::afford(const RayScene& rays, const FirstView& first, const DirectSettings& options,
                            ThreadPool& pool) const
{
    if (!(budget_seconds(options_) > 0.0)) return options;
    const auto seconds = [&](const DirectSettings& tried) {
        return try_direct_light(rays, first.gbuffer, first.view, first.shading, tried, pool);
    };
    const double room = kMostForDirect * (budget_seconds(options_) - elapsed());
    if (seconds(options) * kWithPenumbras <= room) return options;
    DirectSettings fewer = options;
    for (fewer.lamp_picks = options.area_samples;; fewer.lamp_picks /= 2) {
        fewer.area_samples = fewer.lamp_picks;
        if (fewer.lamp_picks == 1 || seconds(fewer) <= room) return fewer;
    }
}

RecordSettings Goal::overture(const RecordSettings& options)
{
    RecordSettings coarse = options;
    coarse.error_tolerance = 0.25f;
    coarse.rays = 64;
    return coarse;
}

int Goal::rays_of_round(int rays) const
{
    if (!is_set()) return rays;
    return std::max(1, budget_seconds(options_) > 0.0 ? rays / 8 : rays / 2);
}

namespace {

/// The error of a first view's picture. @param lobes  factor of the error of traced lobes
double picture_error(const FirstView& first, PassLight light, float lobes)
{
    for (float& error : light.traced.error) error *= lobes;
    LayeredImage picture;
    accumulate_pass(first.gbuffer, first.view, first.shading, light, {}, nullptr, picture);
    finish_passes(1, picture);
    return estimate_error(picture).mean_relative;
}

/// Mean relative error that one round of traced lobes alone leaves.
double lobe_error(const FirstView& first, PassLight light)
{
    if (light.traced.radiance.empty()) return 0.0;
    for (auto* part : {&light.indirect_error.noise, &light.indirect_error.spread})
        std::fill(part->begin(), part->end(), 0.0f);
    return picture_error(first, std::move(light), 1.0f);
}

}  // namespace

/// From the coarse records: how many passes, what which error costs, what the records are to reach. None: stop.
std::optional<RecordGoal> Goal::set(const FirstView& first, const RecordForecast& records, RenderStats& stats,
                                    const ForecastFunction& tell)
{
    const double budget = budget_seconds(options_), before = elapsed();
    const double lobes = part_with_lobes(first);
    const double pass_seconds =
        seconds_of(stats, "gbuffer") + seconds_of(stats, "direct") + seconds_of(stats, "glossy");
    const auto rest_of = [&](int passes) {
        return looks_after(passes, lobes) * records.look_seconds + (passes - 1) * pass_seconds;
    };
    const auto passes_cost = [&] { return rest_of(passes_) - rest_of(1); };
    while (budget > 0.0 && passes_ > 1 && passes_cost() > kMostForPasses * (budget - before - rest_of(1))) --passes_;
    const double rest = rest_of(passes_);
    pass_seconds_ = rest_of(2) - rest_of(1);

    PassLight light = first.light;
    light.indirect = records.sums;
    light.indirect_error = records.errors;
    const double of_lobes = lobe_error(first, light) / std::sqrt(static_cast<double>(passes_));
    const double of_records = std::max(1e-6, picture_error(first, std::move(light), 0.0f));
    // Records leave room for the lobes: they stop short of the goal, and are not all of the light.
    const double left_by_records =
        1.0 - kShareOfGoal * of_records / std::max(1e-6, mean_errors(records.sums, records.errors).total);
    const double round_seconds = seconds_of(stats, "glossy") * passes_;
    const auto seconds_to = [&](double error) {
        const double too_much = kLobesAdd * of_lobes / (std::max(1.0 - kShareOfGoal, left_by_records) * error);
        const double rounds = std::clamp(std::ceil(too_much * too_much), 1.0, kMostLobeRounds * 1.0);
        return before + rest + records.seconds_to(error) + (rounds - 1.0) * round_seconds;
    };
    Forecast& forecast = stats.forecast;
    for (const double error : kForecastErrors) forecast.points.push_back({error, seconds_to(error)});
    forecast.passes = passes_;
    forecast.goal_error = target_error(options_);
    if (budget > 0.0) forecast.goal_error = std::max(forecast.goal_error, error_within(seconds_to, budget));
    forecast.goal_seconds = seconds_to(forecast.goal_error);
    if (tell) tell(forecast);
    stopped_ = options_.dry_run;
    if (stopped_) return std::nullopt;
    if (!(budget > 0.0)) return RecordGoal{target_error(options_)};
    double left = budget - elapsed() - (passes_ - 1) * pass_seconds;
    if (round_seconds > 0.0) {
        // Time goes where the error is.
        const double share = of_lobes / (of_lobes + of_records);
        const double for_light = std::max(0.0, left - looks_after(passes_, lobes) * records.look_seconds);
        lobe_rounds_ = 1 + static_cast<int>(std::min(share * for_light / round_seconds, kMostLobeRounds * 1.0));
        left -= (lobe_rounds_ - 1) * round_seconds;
    }
    return RecordGoal{target_error(options_), std::max(1e-3, left), looks_after(passes_, lobes), forecast.goal_error};
}

void Goal::place(const RayScene& rays, const FirstView& first, ThreadPool& pool, const LightCache* cache,
                 RecordSettings& options, std::vector<Record>& records, RenderStats& stats,
                 const ProgressFunction& progress, const ForecastFunction& forecast)
{
    float done = 0.0f;
    const auto report = [&](float fraction) {
        done = std::max(done, std::min(0.99f, done + 0.1f * fraction));  // how many rounds there will be, nobody knows
        if (progress && !progress("records", done))
            throw Error(ErrorCode::cancelled, "cancelled while gathering records");
    };
    Placement placement(rays, first.gbuffer, first.view, overture(options), pool, records, stats.records, cache,
                        report);
    const double most = budget_seconds(options_) > 0.0
                            ? std::max(1e-3, kMostForOverture * (budget_seconds(options_) - elapsed()))
                            : 0.0;
    place_to_goal(placement, first.view, options_.overlap, most,
                  budget_seconds(options_) > 0.0 ? 0.0 : target_error(options_), pool, records, stats.records,
                  [&](const RecordForecast& cost) { return set(first, cost, stats, forecast); });
    options = placement.options();
}

bool Goal::wants_more_lobes(const FirstView& first, int rounds) const
{
    const bool has_target = target_error(options_) > 0.0 && !(budget_seconds(options_) > 0.0);
    if (!has_target || first.light.traced.radiance.empty() || rounds >= kMostLobeRounds) return false;
    // Every pass traces by itself.
    const double error = picture_error(first, first.light, 1.0f / std::sqrt(static_cast<float>(passes_)));
    return error > target_error(options_) && picture_error(first, first.light, 0.0f) < 0.98 * error;
}

void add_round(TracedLight& light, const TracedLight& more, int rounds)
{
    const float share = 1.0f / static_cast<float>(rounds + 1);
    for (std::size_t i = 0; i < light.radiance.size(); ++i) {
        light.radiance[i] = glm::mix(light.radiance[i], more.radiance[i], share);
        light.error[i] = std::hypot((1.0f - share) * light.error[i], share * more.error[i]);
    }
}

}  // namespace rcs
