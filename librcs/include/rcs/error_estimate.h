#pragma once

#include "rcs/image.h"

namespace rcs {

/// What `compare` would say of the indirect layer against the truth, estimated from the render alone. The errors are
/// |I - R| / (R + 1 % of the mean of R) on luminance, as in ErrorMetrics.
struct ErrorEstimate {
    double mean_relative = 0.0;
    double median_relative = 0.0;
    double p95_relative = 0.0;
};

/// Sums up the layers `indirect` and `indirect_error`, taking the error of each pixel as normally distributed.
/// All 0 where there is no such layer, or no light.
ErrorEstimate estimate_error(const LayeredImage& image);

}  // namespace rcs
