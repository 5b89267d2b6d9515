#pragma once

#include <string>
#include <vector>

#include "rcs/camera.h"
#include "rcs/gl_context.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/reference.h"
#include "rcs/sweep.h"
#include "rcs/thread_pool.h"
#include "report/accuracy_report.h"

namespace rcs::service {

/// What is measured, and how.
struct SweepPlan {
    std::string cache;               ///< folder that keeps reference and points, exists
    std::vector<SweepPoint> points;  ///< all of the view's size
    std::vector<int> path_samples;   ///< paths a pixel for the path tracer's points, rising; see is_round()
    ReferenceOptions reference;      ///< as converge() takes it
    double reference_error = 0.02;   ///< its own mean relative error at which it is good enough, > 0
    std::uint64_t path_seed = 3;     ///< of the path tracer's points; the reference takes its seed and the next
};

/// Traces the reference, measures every point, and keeps each result in the cache: whatever is there already and
/// belongs to the same scene, view, options, library and machine is taken as it is.
/// @return report with the figures and pictures; scene and camera names are left to the caller
/// @throws rcs::Error cancelled: what was finished is kept; bad_argument: nothing indirect to measure
AccuracyReport run_sweep(Session& session, const View& view, const SweepPlan& plan, const LogFunction& log,
                         const ProgressFunction& progress);

}  // namespace rcs::service
