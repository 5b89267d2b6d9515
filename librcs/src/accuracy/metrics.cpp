#include "rcs/metrics.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <vector>

#include "accuracy/flip.h"
#include "accuracy/low_frequency.h"
#include "image/cut.h"
#include "rcs/error.h"
#include "util/color.h"
#include "util/srgb.h"

namespace rcs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

const Image& layer_of(const LayeredImage& image, const std::string& name, const char* which)
{
    const auto found = image.layers.find(name);
    if (found != image.layers.end()) {
        return found->second;
    }
    std::string names;
    for (const auto& [other, layer] : image.layers) {
        names.append(names.empty() ? "" : ", ").append(other);
    }
    throw Error(ErrorCode::not_found, std::string("the ") + which + " has no layer \"" + name +
                                          "\"; there are: " + (names.empty() ? "none" : names));
}

int stride_of(const LayeredImage& image, const char* which)
{
    const auto found = image.metadata.find("rcs:stride");
    if (found == image.metadata.end()) {
        return 1;
    }
    char* end = nullptr;
    const long stride = std::strtol(found->second.c_str(), &end, 10);
    if (end == found->second.c_str() || *end != '\0' || stride < 1 || stride > 16384) {
        throw Error(ErrorCode::bad_argument, std::string("rcs:stride of the ") + which + " is \"" + found->second +
                                                 "\", expected a whole number in [1, 16384]");
    }
    return static_cast<int>(stride);
}

/// How many of s/2, s/2 + s, ... lie below `size`.
int strided_size(int size, int stride) { return (size - stride / 2 + stride - 1) / stride; }

std::string size_text(const Image& image) { return std::to_string(image.width) + "x" + std::to_string(image.height); }

/// The step between pixels of `image` that matches one pixel of `reference`.
int matching_stride(const LayeredImage& image, const Image& a, const LayeredImage& reference, const Image& b)
{
    const int image_stride = stride_of(image, "image");
    const int stride = stride_of(reference, "reference");
    if (image_stride == stride && a.width == b.width && a.height == b.height) {
        return 1;
    }
    if (image_stride == 1 && strided_size(a.width, stride) == b.width && strided_size(a.height, stride) == b.height) {
        return stride;
    }
    throw Error(ErrorCode::bad_argument, "the image is " + size_text(a) + " with stride " +
                                             std::to_string(image_stride) + ", the reference " + size_text(b) +
                                             " with stride " + std::to_string(stride) + ": they do not match");
}

/// A pixel's one value that errors are taken of: luminance, or the value itself of a scalar layer.
double level(const float* pixel, int channels)
{
    return channels >= 3 ? static_cast<double>(luminance({pixel[0], pixel[1], pixel[2]}))
                         : static_cast<double>(pixel[0]);
}

double display_value(float v) { return static_cast<double>(srgb_from_linear(std::clamp(v, 0.0f, 1.0f))); }

/// x/y where 0/0 is `undefined`: both pictures are black there.
double ratio(double x, double y, double undefined) { return x == 0.0 && y == 0.0 ? undefined : x / y; }

/// The smallest value that at least a fraction p of all values do not exceed. Reorders `values`.
double percentile(std::vector<double>& values, double p)
{
    const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(values.size())));
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

/// The finite pixels of both images, side by side.
struct Samples {
    std::vector<double> image, reference;
    std::size_t not_finite = 0;
    double display_square_error = 0.0;  ///< summed over pixels and colours
};

Samples take_samples(const Image& a, const Image& b, int stride)
{
    Samples samples;
    const int colours = std::min(b.channels, 3);
    for (int y = 0; y < b.height; ++y) {
        for (int x = 0; x < b.width; ++x) {
            const float* p = a.at(stride / 2 + x * stride, stride / 2 + y * stride);
            const float* q = b.at(x, y);
            const double i = level(p, a.channels);
            const double r = level(q, b.channels);
            if (!std::isfinite(i) || !std::isfinite(r)) {
                ++samples.not_finite;
                continue;
            }
            samples.image.push_back(i);
            samples.reference.push_back(r);
            for (int c = 0; c < colours; ++c) {
                const double d = display_value(p[c]) - display_value(q[c]);
                samples.display_square_error += d * d;
            }
        }
    }
    samples.display_square_error /= static_cast<double>(colours);
    return samples;
}

double mean(const std::vector<double>& values)
{
    double sum = 0.0;
    for (const double v : values) sum += v;
    return sum / static_cast<double>(values.size());
}

/// What keeps relative errors finite where the reference is black.
double epsilon(double mean_reference) { return kRelativeErrorFloor * std::abs(mean_reference); }

/// Mean of the finite values of one layer, on luminance; 0 if there is none.
double finite_mean(const Image& image)
{
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < image.pixels.size(); i += static_cast<std::size_t>(image.channels)) {
        const double v = level(image.pixels.data() + i, image.channels);
        if (std::isfinite(v)) {
            sum += v;
            ++count;
        }
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

/// The layers of both images, and the step between pixels of the first that match those of the second.
struct Pair {
    const Image& image;
    const Image& reference;
    int stride;
};

Pair matching_layers(const LayeredImage& image, const LayeredImage& reference, const std::string& layer)
{
    const Image& a = layer_of(image, layer, "image");
    const Image& b = layer_of(reference, layer, "reference");
    if ((a.channels >= 3) != (b.channels >= 3)) {
        throw Error(ErrorCode::bad_argument, "layer " + layer + " has " + std::to_string(a.channels) +
                                                 " channels in the image and " + std::to_string(b.channels) +
                                                 " in the reference");
    }
    return {a, b, matching_stride(image, a, reference, b)};
}

/// (I-R) / (R + eps) of each pixel, row by row; NaN where either is not finite.
std::vector<double> signed_errors(const Pair& pair)
{
    const double eps = epsilon(finite_mean(pair.reference));
    std::vector<double> errors;
    errors.reserve(pair.reference.pixels.size() / static_cast<std::size_t>(pair.reference.channels));
    for (int y = 0; y < pair.reference.height; ++y) {
        for (int x = 0; x < pair.reference.width; ++x) {
            const float* p = pair.image.at(pair.stride / 2 + x * pair.stride, pair.stride / 2 + y * pair.stride);
            const double i = level(p, pair.image.channels);
            const double r = level(pair.reference.at(x, y), pair.reference.channels);
            const double d = ratio(i - r, std::abs(r) + eps, 0.0);
            errors.push_back(std::isfinite(d) ? d : kUndefined);
        }
    }
    return errors;
}

LowFrequency low_frequency_of(const Pair& pair)
{
    return low_frequency(signed_errors(pair), pair.reference.width, pair.reference.height);
}

/// The layer that has a layer's standard errors, where a picture has one.
std::string errors_of(const std::string& layer)
{
    return layer == "beauty" ? "standard_error" : layer + "_standard_error";
}

/// The part of a whole picture that a crop of one of its size shows; none where it is none.
std::optional<LayeredImage> part_shown(const LayeredImage& whole, const LayeredImage& crop, const std::string& layer,
                                       const char* which)
{
    if (whole.window || !crop.window) return std::nullopt;
    const Image& from = layer_of(whole, layer, which);
    const Image& part = crop.layers.begin()->second;
    const ImageWindow& w = *crop.window;
    if (from.width != w.whole_width || from.height != w.whole_height || w.x < 0 || w.y < 0 ||
        part.width > from.width - w.x || part.height > from.height - w.y)
        return std::nullopt;
    LayeredImage shown{{{layer, cut(from, w.x, w.y, part.width, part.height)}}, w, whole.metadata, {}};
    if (const auto errors = whole.layers.find(errors_of(layer)); errors != whole.layers.end())
        shown.layers.emplace(errors->first, cut(errors->second, w.x, w.y, part.width, part.height));
    return shown;
}

/// MRE that the standard errors of the reference's layer would make by themselves; NaN where it has none.
/// @param eps  as relative errors have it
double noise_of(const LayeredImage& reference, const std::string& layer, double eps)
{
    const auto found = reference.layers.find(errors_of(layer));
    if (found == reference.layers.end()) return kUndefined;
    const Image& values = layer_of(reference, layer, "reference");
    const Image& errors = found->second;
    if (errors.width != values.width || errors.height != values.height) return kUndefined;
    double sum = 0.0;
    std::size_t count = 0;
    for (int y = 0; y < values.height; ++y) {
        for (int x = 0; x < values.width; ++x) {
            const double r = level(values.at(x, y), values.channels), e = level(errors.at(x, y), errors.channels);
            if (!std::isfinite(r) || !std::isfinite(e)) continue;
            sum += ratio(e, std::abs(r) + eps, 0.0);
            ++count;
        }
    }
    // Mean of |x|, x normal, over its deviation.
    constexpr double kOfDeviation = std::numbers::sqrt2 * std::numbers::inv_sqrtpi;
    return count > 0 ? kOfDeviation * sum / static_cast<double>(count) : kUndefined;
}

constexpr const char* kNoNeighbours = "the pixels of the reference are not neighbours";

using M = ErrorMetrics;
constexpr MetricRow kMetrics[] = {
    {&M::mean_relative_error, "mean_relative_error", "mre", "MRE", "%.4f %%", 100.0, kInfinity, nullptr},
    {&M::median_relative_error, "median_relative_error", "median", "median", "%.4f %%", 100.0, kInfinity, nullptr},
    {&M::p95_relative_error, "p95_relative_error", "p95", "p95", "%.4f %%", 100.0, kInfinity, nullptr},
    {&M::relmse, "relmse", "relmse", "relMSE", "%.6g", 1.0, kInfinity, nullptr},
    {&M::rmse, "rmse", "rmse", "RMSE", "%.6g", 1.0, kInfinity, nullptr},
    {&M::ratio_of_means, "ratio_of_means", "ratio_of_means", "ratio of means", "%.6f", 1.0, kInfinity, nullptr},
    {&M::display_psnr, "display_psnr", "display_psnr", "display PSNR", "%.2f dB", 1.0, kInfinity, nullptr},
    {&M::flip, "flip", "flip", "FLIP", "%.4f", 1.0, kUndefined, kNoNeighbours},
    {&M::low_frequency_error, "low_frequency_error", "low_frequency", "low frequency", "%.4f %%", 100.0, kUndefined,
     kNoNeighbours},
    {&M::low_frequency_ratio, "low_frequency_ratio", "low_frequency_ratio", "x white noise", "%.2f", 1.0, kUndefined,
     kNoNeighbours},
    {&M::reference_noise, "reference_noise", "noise", "noise in it", "%.4f %%", 100.0, kUndefined,
     "the reference says no standard error of this layer"},
};

}  // namespace

std::span<const MetricRow> metric_table() { return kMetrics; }

ErrorMetrics compare_images(const LayeredImage& image, const LayeredImage& reference, const std::string& layer)
{
    if (const auto part = part_shown(image, reference, layer, "image")) return compare_images(*part, reference, layer);
    if (const auto part = part_shown(reference, image, layer, "reference")) return compare_images(image, *part, layer);
    const Pair pair = matching_layers(image, reference, layer);
    const Samples samples = take_samples(pair.image, pair.reference, pair.stride);

    ErrorMetrics metrics;
    metrics.pixels = samples.image.size();
    metrics.not_finite = samples.not_finite;
    metrics.display_psnr = std::numeric_limits<double>::infinity();
    if (metrics.pixels == 0) {
        return metrics;
    }
    if (stride_of(reference, "reference") == 1) {
        metrics.flip = mean_flip(pair.image, pair.reference);
        const LowFrequency low = low_frequency_of(pair);
        metrics.low_frequency_error = low.error;
        metrics.low_frequency_ratio = low.over_white_noise;
    }
    const double mean_reference = mean(samples.reference);
    const double eps = epsilon(mean_reference);
    metrics.reference_noise = noise_of(reference, layer, eps);
    std::vector<double> relative(metrics.pixels);
    double square = 0.0, relative_square = 0.0;
    for (std::size_t i = 0; i < metrics.pixels; ++i) {
        const double r = std::abs(samples.reference[i]);
        const double d = samples.image[i] - samples.reference[i];
        square += d * d;
        relative_square += ratio(d * d, r * r + eps * eps, 0.0);
        relative[i] = ratio(std::abs(d), r + eps, 0.0);
    }
    const auto n = static_cast<double>(metrics.pixels);
    metrics.relmse = relative_square / n;
    metrics.rmse = std::sqrt(square / n);
    metrics.mean_relative_error = mean(relative);
    metrics.median_relative_error = percentile(relative, 0.5);
    metrics.p95_relative_error = percentile(relative, 0.95);
    metrics.ratio_of_means = ratio(mean(samples.image), mean_reference, 1.0);
    if (samples.display_square_error > 0.0) {
        metrics.display_psnr = -10.0 * std::log10(samples.display_square_error / n);
    }
    return metrics;
}

Image relative_difference(const LayeredImage& image, const LayeredImage& reference, const std::string& layer)
{
    const Pair pair = matching_layers(image, reference, layer);
    const std::vector<double> relative = signed_errors(pair);
    Image difference(pair.reference.width, pair.reference.height, 1);
    std::transform(relative.begin(), relative.end(), difference.pixels.begin(),
                   [](double d) { return static_cast<float>(d); });
    return difference;
}

}  // namespace rcs
