#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "accuracy/error_estimate.h"
#include "placement/placement.h"

namespace rcs {

/// What records come down to, of a goal: an estimate scatters.
inline constexpr double kShareOfGoal = 0.87;

/// What records cost so far, and what they would cost for a smaller error.
struct RecordForecast {
    const SplatBuffer& sums;    ///< of the coarse records that the forecast is made from
    const ErrorMap& errors;     ///< of those, as probes have found them
    const ErrorScale& scale;    ///< of judging them
    double look_seconds = 0.0;  ///< a splat of irradiance and the estimate of its error
    /// Seconds from here to a mean relative error of the records' light.
    std::function<double(double)> seconds_to;
};

/// Where to stop: at a mean relative error, or when so many seconds are spent.
struct RecordGoal {
    double mean_relative = 0.0;  ///< 0: as small as time allows
    double seconds = 0.0;        ///< of wall time from now on; 0: as many as it takes
    double looks_after = 0.0;    ///< of them, what comes after takes as many as so many looks
    double likely = 0.0;         ///< mean relative error that the seconds are thought to be enough for
    bool is_told = false;        ///< what it comes to is asked for: one more look, of looks_after
};

/// What views before have found of their records, which are still there.
struct KnownError {
    ErrorScale scale;    ///< by probes
    float noise = 0.0f;  ///< that a goal brought them to, as RecordSettings::noise_target
    double seconds_per_ray = 0.0;
};

/// The coarse records that a forecast is made from.
struct Overture {
    double seconds =
        0.0;  ///< they start far apart and come closer while this lasts; 0: as close as the settings say at once
    double target = 0.0;                   ///< mean relative error that is to be reached; 0: none, there is a budget
    std::optional<KnownError> known = {};  ///< none: records are judged by probes of their own
};

/// A splat of the records so far.
struct RecordLook {
    const SplatBuffer& sums;
    const ErrorMap& errors;
    const ErrorScale& scale;
};

/// What the error was judged by in the end.
struct Steered {
    std::unique_ptr<Probes> probes;  ///< null: what was known from views before
    ErrorScale scale;
    double seconds_per_ray = 0.0;
    double error = 0.0;  ///< mean relative, at the last look
};

/// Whom steering asks and tells.
struct SteeringHooks {
    /// Asked after the overture; none stops there.
    std::function<std::optional<RecordGoal>(const RecordForecast&)> set_goal;
    std::function<void(const RecordLook&)> after_step;  ///< told of the overture, and of each step; may throw
};

/// Places records as the estimated error asks for: first a coarse overture that serves every pixel; then, down steps
/// that are the same for every goal, records closer together where their extrapolations disagree, and more rays where
/// they lower the mean error most.
/// @param placement  with options().rays and spacing for the overture; options() are left as the last step used them,
///        so that further views are filled alike
/// Records of other views that lie on what is seen take part.
/// Where most records are those of views before, they stay as they are while that reaches the goal.
Steered place_to_goal(Placement& placement, const View& view, float overlap, const Overture& overture, ThreadPool& pool,
                      std::vector<Record>& records, RecordStats& stats, const SteeringHooks& hooks);

}  // namespace rcs
