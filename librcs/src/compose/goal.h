#pragma once

#include <chrono>
#include <optional>

#include "compose/compose.h"
#include "placement/error_driven.h"
#include "rcs/direct_light.h"
#include "rcs/render.h"

namespace rcs {

/// What the camera sees first, and its light as far as it is known: lobes before records, then both.
struct FirstView {
    const GBuffer& gbuffer;
    const View& view;
    const Shading& shading;
    const PassLight& light;
    bool has_lobes;  ///< that records light
};

/// Steers a render to a target error or a budget: what the first view's records are to reach, how
/// many passes there are, how often narrow lobes are traced.
class Goal {
public:
    explicit Goal(const RenderOptions& options);

    bool is_set() const { return has_goal(options_); }
    int passes() const { return passes_; }
    /// Asked before each pass, with how many are done. With a budget passes() follows what they really take.
    bool wants_pass(int done);
    /// With a budget too short for all shadow rays: fewer. Asked before the first view's direct light.
    DirectSettings afford(const RayScene& rays, const FirstView& first, const DirectSettings& options,
                          ThreadPool& pool) const;
    /// How often the first view's lobes are traced before wants_more_lobes() is asked.
    int lobe_rounds() const { return lobe_rounds_; }
    /// Rays of one round of tracing: few, so that there can be as many as it takes.
    int rays_of_round(int rays) const;
    bool stopped() const { return stopped_; }

    /// What the coarse records are made with, which error and time are forecast from.
    static RecordSettings overture(const RecordSettings& options);

    /// Places the first view's records. @param options  become those that later views are to be filled with
    /// @param stats  stages so far: what another pass would cost
    void place(const RayScene& rays, const FirstView& first, ThreadPool& pool, const LightCache* cache,
               RecordSettings& options, std::vector<Record>& records, RenderStats& stats,
               const ProgressFunction& progress, const ForecastFunction& forecast);

    /// Whether tracing the lobes once more would bring the picture nearer to the target. @param rounds  so far
    bool wants_more_lobes(const FirstView& first, int rounds) const;

private:
    double elapsed() const;
    std::optional<RecordGoal> set(const FirstView& first, const RecordForecast& records, RenderStats& stats,
                                  const ForecastFunction& forecast);

    const RenderOptions& options_;
    std::chrono::steady_clock::time_point start_;
    int passes_;
    double pass_seconds_ = 0.0, pass_ended_ = 0.0;  ///< what a further pass takes; when the last one was done [s]
    int lobe_rounds_ = 1;
    bool stopped_ = false;
};

/// Averages a further round of traced lobes into those of `rounds` rounds.
void add_round(TracedLight& light, const TracedLight& more, int rounds);

}  // namespace rcs
