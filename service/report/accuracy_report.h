#pragma once

#include <string>
#include <vector>

#include "report/measurement.h"

namespace rcs::service {

/// The image that all others are judged by, and how sure it is.
struct ReferenceSummary {
    int paths = 0;              ///< a pixel
    double seconds = 0.0;       ///< that tracing it took, in all runs together
    double error = 0.0;         ///< its own, mean relative, of the indirect layer: what a perfect image would measure
    double wanted_error = 0.0;  ///< what that was to reach
    std::string picture, indirect;  ///< JPEG files in memory
};

/// All that `rcsplat accuracy` found out about one view.
struct AccuracyReport {
    std::string scene, camera;
    int width = 0, height = 0;  ///< [px]
    int bounces = 0, aa = 0, threads = 0;
    std::string processor, gl_renderer;
    std::string command;                    ///< that renders this view, but for settings and outputs
    int final_width = 0, final_height = 0;  ///< of the picture that all this is for [px]; 0: not said
    ReferenceSummary reference;
    std::vector<Measurement> points;  ///< renders from coarse to fine, then the path tracer's

    std::vector<CostPoint> renders() const { return costs_of(points, true, reference.error); }
    std::vector<CostPoint> paths() const { return costs_of(points, false, reference.error); }
};

}  // namespace rcs::service
