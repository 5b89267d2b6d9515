#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/render.h"

namespace rcs {

/// One way to render a view, to be measured against others.
struct SweepPoint {
    std::string label;      ///< what a user types for it: "--accuracy 0.2 --rays 128 --noise 0.02"
    RenderOptions options;  ///< the same in full
};

/// Ways to render from coarse and quick to fine and slow: accuracy, rays and noise refined together.
/// @param base  all other options
/// @param count  in [2, kMostSweepPoints]; spread evenly, coarsest and finest are always there
RCS_API std::vector<SweepPoint> settings_sweep(const RenderOptions& base, int count);
/// Of settings_sweep().
inline constexpr int kMostSweepPoints = 10;

/// `base` with Ward's a, rays a record and noise target as given.
RCS_API SweepPoint settings_point(const RenderOptions& base, float accuracy, int rays, float noise);

/// What an image cost and how wrong it is.
struct CostPoint {
    double seconds = 0.0;  ///< > 0
    double error = 0.0;    ///< >= 0; any one metric, relative
};

/// The points that no other beats: nothing else is both at least as quick and at least as right, and better in one.
/// @return indices, by rising time (and so by falling error); of equal points the first
RCS_API std::vector<std::size_t> pareto_front(const std::vector<CostPoint>& points);

/// The time for which an error is to be had, along the Pareto front and between its points by a power law
/// (a straight line in a log-log plot).
/// @return none if no point is as good as `error`; the quickest point's time if all are
RCS_API std::optional<double> seconds_for_error(const std::vector<CostPoint>& points, double error);

}  // namespace rcs
