#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "rcs/api.h"
#include "rcs/image.h"

namespace rcs {

/// Part of the mean that relative errors add to what they divide by, so that black pixels have one too.
inline constexpr double kRelativeErrorFloor = 0.01;

/// Errors of image I against reference R, on luminance (Rec. 709: 0.2126, 0.7152, 0.0722), with
/// eps = kRelativeErrorFloor mean(R). Pixels where either is not finite are counted, not averaged.
struct ErrorMetrics {
    std::size_t pixels = 0;              ///< that were compared
    std::size_t not_finite = 0;          ///< that were not
    double relmse = 0.0;                 ///< mean (I-R)^2 / (R^2 + eps^2)
    double rmse = 0.0;                   ///< sqrt mean (I-R)^2
    double mean_relative_error = 0.0;    ///< MRE: mean |I-R| / (R + eps)
    double median_relative_error = 0.0;  ///< of |I-R| / (R + eps)
    double p95_relative_error = 0.0;     ///< 95th percentile of |I-R| / (R + eps)
    double ratio_of_means = 1.0;         ///< mean(I) / mean(R); 1 is unbiased
    double display_psnr = 0.0;           ///< [dB], of the sRGB-encoded, clipped RGB images; +inf if equal
    /// Mean FLIP (Andersson et al. 2020) of the clipped images at 67 pixels a degree, in [0, 1]; NaN if the reference
    /// was traced with a stride, since FLIP sees neighbours.
    double flip = std::numeric_limits<double>::quiet_NaN();
    /// What one sees as clouds: mean |G * (I-R) / (R + eps)|, G a Gaussian of 8 pixels; NaN as for FLIP.
    double low_frequency_error = std::numeric_limits<double>::quiet_NaN();
    /// low_frequency_error over that of white noise of the same MRE: 1 for noise of pixels that know nothing of each
    /// other, 28 where the error keeps its sign over much more than 8 pixels; 0 without any error; NaN as for FLIP.
    double low_frequency_ratio = std::numeric_limits<double>::quiet_NaN();
    /// The part of these errors that is the reference's own: the MRE that its noise alone would make, at most. Noise
    /// that is independent adds to an error as squares do: of an MRE of three times this one, a twentieth is noise. NaN
    /// where the reference says no standard errors of the layer (beauty and indirect light of a path-traced one).
    double reference_noise = std::numeric_limits<double>::quiet_NaN();
};

/// A metric as files and tables show it.
struct MetricRow {
    double ErrorMetrics::* value;  ///< where it lies
    const char* name;              ///< in JSON: "mean_relative_error"
    const char* column;            ///< in CSV: "mre"
    const char* words;             ///< for people: "MRE"
    const char* format;            ///< printf's, of the value times `scale`
    double scale;                  ///< of what is shown
    double if_null;                ///< what JSON's null stands for, which knows no infinity and no NaN
    const char* why_undefined;     ///< for people, where it is NaN; null: it never is
};
/// All metrics of ErrorMetrics, in the order that they are shown in.
RCS_API std::span<const MetricRow> metric_table();

/// Compares one layer of two images of the same view. If `reference` was traced with a stride, the
/// same pixels of `image` are taken.
/// @throws Error not_found (layer), bad_argument (sizes that do not match)
RCS_API ErrorMetrics compare_images(const LayeredImage& image, const LayeredImage& reference,
                                    const std::string& layer = "beauty");

/// (I-R) / (R + eps) at each pixel on luminance, with the eps of ErrorMetrics: one channel, of the reference's size.
/// 0 where both are black, NaN where either is not finite.
/// @throws as compare_images()
RCS_API Image relative_difference(const LayeredImage& image, const LayeredImage& reference, const std::string& layer);

}  // namespace rcs
