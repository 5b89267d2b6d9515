#pragma once

#include "rcs/api.h"
#include "rcs/image.h"

namespace rcs {

/// What `compare` would say of a layer against the truth, estimated from the render alone. The errors are
/// |I - R| / (R + 1 % of the mean of R) on luminance, as in ErrorMetrics.
struct ErrorEstimate {
    double mean_relative = 0.0;    ///< over all pixels
    double median_relative = 0.0;  ///< of them
    double p95_relative = 0.0;     ///< 95th percentile
};

/// Of the two that are told of every picture: 0 where there is no such light, or no estimate of it.
struct ErrorEstimates {
    ErrorEstimate image;     ///< of the layer beauty
    ErrorEstimate indirect;  ///< of the layer indirect
};

/// Sums up layers and their standard errors, `direct_error` and `indirect_error`, taking the error of each pixel as
/// normally distributed.
RCS_API ErrorEstimates estimate_errors(const LayeredImage& image);

}  // namespace rcs
