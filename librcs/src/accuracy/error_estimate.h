#pragma once

#include <vector>

#include "accuracy/error_scale.h"
#include "rcs/error_estimate.h"
#include "rcs/splat.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Standard errors of the irradiance that a splat gives each pixel, relative to it, on luminance.
struct ErrorMap {
    std::vector<float> noise;   ///< from the records' own rays, averaged as the splat averages them
    std::vector<float> spread;  ///< from the first-order expansion: what the records' extrapolations differ by beyond
                                ///< their noise. Of this, a pixel by itself sees a rough sample: it is averaged over a
                                ///< window about as large as the distance between records.
    /// @param part  that is left of both
    float total(std::size_t pixel, float part = 1.0f) const;
};
/// @param stats  of this splat alone: how large a record is on the image
ErrorMap error_map(const SplatBuffer& sums, const SplatStats& stats, float overlap, ThreadPool& pool);

/// As probes have found the errors to be.
void scale(ErrorMap& map, const ErrorScale& scale, ThreadPool& pool);

/// The same with what probes found. @param scale  of judging, not of the map
ErrorEstimates estimate_errors(const LayeredImage& image, const ErrorScale& scale, ThreadPool& pool);
/// Of the picture alone, and of its indirect light alone.
ErrorEstimate estimate_picture_error(const LayeredImage& image, const ErrorScale& scale, ThreadPool& pool);
ErrorEstimate estimate_indirect_error(const LayeredImage& image, const ErrorScale& scale, ThreadPool& pool);

/// The mean absolute value of a normal variable, over its standard deviation: sqrt(2 / pi).
inline constexpr double kMeanAbsolute = 0.7978845608028654;

/// Luminance of what the records make of pixel `i`; 0 where none serves it.
double light_at(const SplatBuffer& sums, std::size_t i);

/// Means over all pixels, as ErrorEstimate::mean_relative, if all light were the irradiance. @param scale  of
/// judging, not of the map
struct MeanErrors {
    double noise = 0.0, spread = 0.0, total = 0.0;
    double mean = 0.0;  ///< irradiance [W m^-2], on luminance
};
/// That mean alone.
double mean_light(const SplatBuffer& sums, ThreadPool& pool);
MeanErrors mean_errors(const SplatBuffer& sums, const ErrorMap& errors, const ErrorScale& scale, ThreadPool& pool);

}  // namespace rcs
