#include "compose/goal.h"

#include <algorithm>
#include <cmath>

#include "rcs/error.h"
#include "records/error_driven.h"

namespace rcs {
namespace {

// Of the time that a budget leaves, what passes beyond the first may take.
constexpr double kMostForPasses = 0.4;
// A splat that lights glossy surfaces takes so many times as long as one of irradiance.
constexpr double kSplatWithLobes = 2.5;
constexpr int kMostLobeRounds = 64;
constexpr double kLobeShare = 0.2;  // of the squared error: records come to 0.95 of the target, and not everywhere are lobes

constexpr double kForecastErrors[] = {0.2, 0.1, 0.05, 0.03, 0.02, 0.01};

double seconds_of(const RenderStats& stats, const char* stage)
{
    for (const auto& [name, seconds] : stats.stage_seconds)
        if (name == stage)
            return seconds;
    return 0.0;
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

RecordOptions Goal::overture(const RecordOptions& options)
{
    RecordOptions coarse = options;
    coarse.error_tolerance = 0.25f;
    coarse.rays = 64;
    return coarse;
}

/// What is left when the first view's records are done.
double Goal::rest(double look_seconds, bool has_lobes, double pass_seconds, int passes) const
{
    // A view is splatted, its error estimated, its layers added up; further ones are drawn, lit, and searched for holes.
    const double view = look_seconds * ((has_lobes ? kSplatWithLobes : 1.0) + 1.0);
    return passes * view + (passes - 1) * (pass_seconds + 2.0 * look_seconds);
}

int Goal::rays_of_round(int rays) const
{
    if (!is_set())
        return rays;
    return std::max(1, options_.budget_seconds > 0.0 ? rays / 8 : rays / 2);
}

namespace {

/// What the picture's error would be if that of the traced lobes were `scale` times as large.
double error_with(const GBuffer& gbuffer, const View& view, const Shading& shading, const PassLight& light, float scale)
{
    PassLight trial = light;
    for (float& error : trial.traced.error)
        error *= scale;
    LayeredImage picture;
    accumulate_pass(gbuffer, view, shading, trial, {}, picture);
    finish_passes(1, picture);
    return estimate_error(picture).mean_relative;
}

}  // namespace

/// Mean relative error that one round of traced lobes alone leaves.
double Goal::lobe_error(const GBuffer& gbuffer, const View& view, const Shading& shading, const PassLight& light) const
{
    if (light.traced.radiance.empty())
        return 0.0;
    PassLight only = light;
    for (auto* part : {&only.indirect_error.noise, &only.indirect_error.spread})
        std::fill(part->begin(), part->end(), 0.0f);
    return error_with(gbuffer, view, shading, only, 1.0f);
}

void Goal::place(const RayScene& rays, const GBuffer& gbuffer, const View& view, const Shading& shading,
                 const PassLight& light, bool has_lobes, ThreadPool& pool, const LightCache* cache, RecordOptions& options, std::vector<Record>& records, RenderStats& stats,
                 const ProgressFunction& progress, const ForecastFunction& forecast)
{
    float done = 0.0f;
    Placement placement(rays, gbuffer, view, overture(options), pool, records, stats.records, cache, [&](float fraction) {
        done = std::max(done, std::min(0.99f, done + 0.1f * fraction));  // how many rounds there will be, nobody knows
        if (progress && !progress("records", done))
            throw Error(ErrorCode::cancelled, "cancelled while gathering records");
    });
    const double pass_seconds = seconds_of(stats, "gbuffer") + seconds_of(stats, "direct") + seconds_of(stats, "glossy");
    place_to_goal(placement, view, options_.overlap, pool, records, stats.records,
                  [&](const RecordForecast& records_cost) -> std::optional<RecordGoal> {
                      const double before = elapsed();
                      const auto rest_of = [&](int passes) {
                          return rest(records_cost.look_seconds, has_lobes, pass_seconds, passes);
                      };
                      const double budget = options_.budget_seconds;
                      if (budget > 0.0)
                          while (passes_ > 1 && rest_of(passes_) - rest_of(1) > kMostForPasses * (budget - before - rest_of(1)))
                              --passes_;
                      const double rest = rest_of(passes_);
                      PassLight trial = light;
                      trial.indirect = records_cost.sums;
                      trial.indirect_error = records_cost.errors;
                      const double of_lobes = lobe_error(gbuffer, view, shading, trial) / std::sqrt(static_cast<double>(passes_));
                      const double of_records = std::max(1e-6, error_with(gbuffer, view, shading, trial, 0.0f));
                      const double round_seconds = seconds_of(stats, "glossy") * passes_;
                      // Rounds of tracing that leave the records most of the error.
                      const auto rounds_to = [&](double error) {
                          return std::clamp(std::ceil(of_lobes * of_lobes / (kLobeShare * error * error)), 1.0, 1.0 * kMostLobeRounds);
                      };
                      const auto seconds_to = [&](double error) {
                          return before + rest + records_cost.seconds_to(error) + (rounds_to(error) - 1.0) * round_seconds;
                      };
                      Forecast& f = stats.forecast;
                      for (const double error : kForecastErrors)
                          f.points.push_back({error, seconds_to(error)});
                      f.passes = passes_;
                      f.goal_error = options_.target_error;
                      if (budget > 0.0)
                          f.goal_error = std::max(f.goal_error, error_within(seconds_to, budget));
                      f.goal_seconds = seconds_to(f.goal_error);
                      if (forecast)
                          forecast(f);
                      stopped_ = options_.dry_run;
                      if (stopped_)
                          return std::nullopt;
                      double left = budget - elapsed() - rest;
                      if (budget > 0.0 && round_seconds > 0.0) {
                          // Time goes where the error is.
                          const double share = of_lobes / (of_lobes + of_records);
                          lobe_rounds_ = 1 + static_cast<int>(std::clamp(share * left / round_seconds, 0.0, 1.0 * kMostLobeRounds));
                          left -= (lobe_rounds_ - 1) * round_seconds;
                      }
                      return RecordGoal{options_.target_error, budget > 0.0 ? std::max(1e-3, left) : 0.0};
                  });
    options = placement.options();
}

bool Goal::wants_more_lobes(const GBuffer& gbuffer, const View& view, const Shading& shading, const PassLight& light,
                            int rounds) const
{
    if (!(options_.target_error > 0.0) || options_.budget_seconds > 0.0 || light.traced.radiance.empty() || rounds >= kMostLobeRounds)
        return false;
    // Every pass traces by itself.
    const double error = error_with(gbuffer, view, shading, light, 1.0f / std::sqrt(static_cast<float>(passes_)));
    return error > options_.target_error && error_with(gbuffer, view, shading, light, 0.0f) < 0.98 * error;
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
