#include "accuracy/error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "accuracy/disagreement.h"
#include "rcs/metrics.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr std::size_t kPixels = 4096;  // at a time

/// Sums over `count` items: of blocks, and then of these in order, so that they do not depend on the threads.
/// @param add  (sums, number of an item)
template <typename Sums, typename Add>
Sums sum_up(std::size_t count, ThreadPool& pool, const Add& add)
{
    std::vector<Sums> of_block((count + kPixels - 1) / kPixels);
    pool.parallel_for(of_block.size(), 1, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t b = begin; b < end; ++b) {
            Sums sums{};
            for (std::size_t i = b * kPixels; i < std::min(count, (b + 1) * kPixels); ++i) add(sums, i);
            of_block[b] = sums;
        }
    });
    Sums all{};
    for (const Sums& sums : of_block) all += sums;
    return all;
}

/// Sums over windows of an image, by a summed-area table in double precision.
class WindowSums {
public:
    /// @param value  of a pixel
    template <typename Value>
    WindowSums(int width, int height, ThreadPool& pool, const Value& value)
        : width_(width), height_(height), table_((size(width) + 1) * (size(height) + 1))
    {
        pool.parallel_for(size(height_), kRows, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t y = begin; y < end; ++y) {
                double row = 0.0;
                for (std::size_t x = 0; x < size(width_); ++x)
                    at(x + 1, y + 1) = row += static_cast<double>(value(y * size(width_) + x));
            }
        });
        pool.parallel_for(size(width_), kColumns, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t y = 1; y < size(height_); ++y)
                for (std::size_t x = begin; x < end; ++x) at(x + 1, y + 1) += at(x + 1, y);
        });
    }
    double around(int x, int y, int reach) const
    {
        const std::size_t x0 = size(std::max(0, x - reach)), x1 = size(std::min(width_, x + reach + 1));
        const std::size_t y0 = size(std::max(0, y - reach)), y1 = size(std::min(height_, y + reach + 1));
        return (at(x1, y1) - at(x0, y1)) - (at(x1, y0) - at(x0, y0));
    }

    /// Pixels of that window.
    double count_around(int x, int y, int reach) const
    {
        return static_cast<double>(std::min(width_, x + reach + 1) - std::max(0, x - reach)) *
               static_cast<double>(std::min(height_, y + reach + 1) - std::max(0, y - reach));
    }

private:
    static constexpr std::size_t kRows = 16, kColumns = 64;  // at a time

    static std::size_t size(int n) { return static_cast<std::size_t>(n); }
    double& at(std::size_t x, std::size_t y) { return table_[y * (size(width_) + 1) + x]; }
    double at(std::size_t x, std::size_t y) const { return table_[y * (size(width_) + 1) + x]; }

    int width_, height_;
    std::vector<double> table_;
};

constexpr std::size_t kBins = 512;
constexpr double kLeastBin = 1e-6, kBinsPerOctave = 16.0;

/// A distribution of standard errors: pixels by their logarithm.
class ErrorHistogram {
public:
    void add(double sigma)
    {
        const float octaves = sigma > kLeastBin ? std::log2(static_cast<float>(sigma / kLeastBin)) : 0.0f;
        const double place = sigma > kLeastBin ? kBinsPerOctave * static_cast<double>(octaves) + 1.0 : 0.0;
        ++bins_[std::min(kBins - 1, static_cast<std::size_t>(place))];
        ++count_;
    }

    ErrorHistogram& operator+=(const ErrorHistogram& other)
    {
        for (std::size_t b = 0; b < kBins; ++b) bins_[b] += other.bins_[b];
        count_ += other.count_;
        return *this;
    }

    /// The absolute error that a part `p` of all pixels stays below.
    double percentile(double p) const
    {
        double low = 0.0, high = 2.0 * sigma_of(kBins - 1);
        for (int step = 0; step < 60; ++step) {
            const double middle = 0.5 * (low + high);
            (part_below(middle) < p ? low : high) = middle;
        }
        return high;
    }

private:
    static double sigma_of(std::size_t bin)
    {
        return bin == 0 ? 0.0 : kLeastBin * std::exp2((static_cast<double>(bin) - 0.5) / kBinsPerOctave);
    }
    double part_below(double error) const
    {
        double below = static_cast<double>(bins_[0]);
        for (std::size_t b = 1; b < kBins; ++b)
            if (bins_[b] > 0)
                below += static_cast<double>(bins_[b]) * std::erf(error / (std::numbers::sqrt2 * sigma_of(b)));
        return count_ > 0 ? below / static_cast<double>(count_) : 1.0;
    }

    std::array<std::size_t, kBins> bins_{};
    std::size_t count_ = 0;
};

}  // namespace

float ErrorMap::total(std::size_t pixel, float part) const
{
    return std::min(1.0f, std::hypot(part * noise[pixel], part * spread[pixel]));
}

ErrorMap error_map(const SplatBuffer& sums, const SplatStats& stats, float overlap, ThreadPool& pool)
{
    const std::size_t pixels = sums.weight.size();
    std::vector<Disagreement> all(pixels);
    pool.parallel_for(pixels, kPixels, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            all[i] = disagreement(sums, i, {sums.weighted_r[i], sums.weighted_g[i], sums.weighted_b[i]});
    });
    const WindowSums excess(sums.width, sums.height, pool, [&](std::size_t i) { return all[i].relative_excess(); });
    const WindowSums lit(sums.width, sums.height, pool,
                         [&](std::size_t i) { return all[i].mean > 0.0f ? 1.0f : 0.0f; });
    // A splat is about two radii wide, `overlap` times the distance between records each.
    const double splats = static_cast<double>(std::max<std::uint64_t>(1, stats.splats));
    const double distance = 0.5 * std::sqrt(static_cast<double>(stats.samples) / splats) / static_cast<double>(overlap);
    const int reach = static_cast<int>(std::lround(distance));
    ErrorMap errors{std::vector<float>(pixels, 0.0f), std::vector<float>(pixels, 0.0f)};
    pool.parallel_for(pixels, kPixels, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!(all[i].mean > 0.0f)) continue;
            const int x = static_cast<int>(i % static_cast<std::size_t>(sums.width));
            const int y = static_cast<int>(i / static_cast<std::size_t>(sums.width));
            errors.noise[i] = all[i].noise();
            errors.spread[i] = error_of_spread(excess.around(x, y, reach) / lit.around(x, y, reach));
        }
    });
    return errors;
}

void scale(ErrorMap& map, const ErrorScale& scale, ThreadPool& pool)
{
    pool.parallel_for(map.noise.size(), kPixels, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto factor = static_cast<float>(scale.of_map(kMeanAbsolute * static_cast<double>(map.total(i))));
            map.noise[i] *= factor;
            map.spread[i] *= factor;
        }
    });
}

double light_at(const SplatBuffer& sums, std::size_t i)
{
    const float l = luminance({sums.weighted_r[i], sums.weighted_g[i], sums.weighted_b[i]});
    return sums.weight[i] > 0.0f ? static_cast<double>(l / sums.weight[i]) : 0.0;
}

double mean_light(const SplatBuffer& sums, ThreadPool& pool)
{
    const std::size_t pixels = sums.weight.size();
    const auto sum = sum_up<double>(pixels, pool, [&](double& all, std::size_t i) { all += light_at(sums, i); });
    return pixels > 0 ? sum / static_cast<double>(pixels) : 0.0;
}

MeanErrors mean_errors(const SplatBuffer& sums, const ErrorMap& errors, const ErrorScale& scale, ThreadPool& pool)
{
    const std::size_t pixels = sums.weight.size();
    const double mean = mean_light(sums, pool);
    MeanErrors result;
    result.mean = mean;
    if (!(mean > 0.0)) return result;
    const auto all = sum_up<glm::dvec3>(pixels, pool, [&](glm::dvec3& so_far, std::size_t i) {
        const double light = light_at(sums, i);
        const double part = light / (light + kRelativeErrorFloor * mean);
        const double total = kMeanAbsolute * part * static_cast<double>(errors.total(i));
        if (!(total > 0.0)) return;
        const double judged = scale.judged(total).mean / static_cast<double>(pixels);
        so_far += glm::dvec3(judged * static_cast<double>(errors.noise[i] / errors.total(i)),
                             judged * static_cast<double>(errors.spread[i] / errors.total(i)), judged);
    });
    result.noise = all.x;
    result.spread = all.y;
    result.total = all.z;
    return result;
}

namespace {

// Where pixels are noisy by themselves, one says little of its own error: those around it do [px].
constexpr int kNoiseReach = 8;
// Relative error that is as good as all noise.
constexpr double kAllNoise = 1.0;
// Of light that is never negative, and right in the mean, the mean error is at most twice of it.
constexpr double kMostOfMean = 2.0;

/// What is not finite has no share in sums over others.
double finite_part(double value) { return std::isfinite(value) ? value : 0.0; }

/// Of a vector: errors are far from where squares overflow.
double length(double x, double y) { return std::sqrt(x * x + y * y); }

std::vector<double> luminances(const LayeredImage& image, const char* name, ThreadPool& pool)
{
    const auto found = image.layers.find(name);
    if (found == image.layers.end()) return {};
    const auto channels = static_cast<std::size_t>(found->second.channels);
    std::vector<double> values(found->second.pixels.size() / channels);
    pool.parallel_for(values.size(), kPixels, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            const float* const p = found->second.pixels.data() + channels * i;
            values[i] = static_cast<double>(channels == 1 ? *p : luminance({p[0], p[1], p[2]}));
        }
    });
    return values;
}

/// Standard errors of an image's luminance: those that each pixel tells by itself, and those that its neighbourhood
/// does.
class FoundErrors {
public:
    FoundErrors(const LayeredImage& image, bool directly, ThreadPool& pool)
        : indirect_(luminances(image, "indirect_error", pool)),
          direct_(directly ? luminances(image, "direct_error", pool) : std::vector<double>{})
    {
        const auto sum = [&](const char* name, const auto& value) {
            const Image& layer = image.layers.at(name);
            return WindowSums(layer.width, layer.height, pool, value);
        };
        if (!indirect_.empty())
            squares_ = sum("indirect_error", [&](std::size_t i) { return finite_part(indirect_[i] * indirect_[i]); });
        if (!direct_.empty()) directs_ = sum("direct_error", [&](std::size_t i) { return finite_part(direct_[i]); });
    }

    double indirect(std::size_t i) const { return indirect_.empty() ? 0.0 : indirect_[i]; }
    double direct(std::size_t i) const { return direct_.empty() ? 0.0 : direct_[i]; }
    double squares_around(int x, int y) const { return squares_ ? squares_->around(x, y, kNoiseReach) : 0.0; }
    double direct_around(int x, int y) const { return directs_ ? directs_->around(x, y, kNoiseReach) : 0.0; }

private:
    std::vector<double> indirect_, direct_;
    std::optional<WindowSums> squares_, directs_;
};

/// What a layer is off by.
struct JudgedLayer {
    int width;
    WindowSums lights;  ///< with what is added to light that errors are relative to
    const FoundErrors& errors;
    bool directly;  ///< direct light is part of it

    double direct(std::size_t i) const { return directly ? errors.direct(i) : 0.0; }

    /// The mean relative error of all pixels near one, and how much they are noise, in [0, 1].
    struct Noise {
        double error, part;
    };
    Noise noise_at(std::size_t i) const
    {
        const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
        const double count = lights.count_around(x, y, kNoiseReach);
        const double indirect = std::sqrt(std::max(0.0, count * errors.squares_around(x, y)));
        const double direct = directly ? errors.direct_around(x, y) : 0.0;
        const double error = kMeanAbsolute * length(indirect, direct) / lights.around(x, y, kNoiseReach);
        const double cube = error / kAllNoise * (error / kAllNoise) * (error / kAllNoise);
        return {error / length(1.0, error / kMostOfMean), std::min(1.0, cube * cube)};
    }
};

/// Errors of some pixels.
struct JudgedPixels {
    double sum = 0.0;  // of their means
    ErrorHistogram histogram;

    JudgedPixels& operator+=(const JudgedPixels& other)
    {
        sum += other.sum;
        histogram += other.histogram;
        return *this;
    }
};

ErrorEstimate estimate_error(const LayeredImage& image, const char* name, const FoundErrors& errors, bool directly,
                             const ErrorScale& scale, ThreadPool& pool)
{
    const std::vector<double> values = luminances(image, name, pool);
    const std::size_t pixels = values.size();
    const auto light = sum_up<double>(pixels, pool, [&](double& all, std::size_t i) { all += finite_part(values[i]); });
    if (!(light > 0.0)) {
        const bool is_lost = !std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
        return is_lost ? ErrorEstimate{kMostOfMean, kMostOfMean, kMostOfMean} : ErrorEstimate{};
    }
    const double dark = kRelativeErrorFloor * light / static_cast<double>(pixels);
    const Image& shown = image.layers.at(name);
    const JudgedLayer layer{
        shown.width,
        WindowSums(shown.width, shown.height, pool, [&](std::size_t i) { return finite_part(values[i]) + dark; }),
        errors, directly};
    const auto judge = [&](JudgedPixels& so_far, std::size_t i) {
        const JudgedLayer::Noise noise = layer.noise_at(i);
        // Direct light that is dark by chance is darker than the truth, which errors are relative to.
        const double truth = length(values[i] + dark, layer.direct(i));
        const double own = kMeanAbsolute * length(errors.indirect(i), layer.direct(i)) / truth;
        if (!std::isfinite(values[i]) || !std::isfinite(own)) {  // as wrong as can be
            so_far.sum += kMostOfMean;
            return so_far.histogram.add(kMostOfMean / kMeanAbsolute);
        }
        const ErrorScale::Judged judged = scale.judged(own);
        so_far.sum += std::lerp(judged.mean, noise.error, noise.part);
        so_far.histogram.add(std::lerp(judged.typical, noise.error, noise.part) / kMeanAbsolute);
    };
    const auto all = sum_up<JudgedPixels>(pixels, pool, judge);
    return {all.sum / static_cast<double>(pixels), all.histogram.percentile(0.5), all.histogram.percentile(0.95)};
}

}  // namespace

ErrorEstimates estimate_errors(const LayeredImage& image)
{
    ThreadPool alone(1);
    return estimate_errors(image, {}, alone);
}

ErrorEstimates estimate_errors(const LayeredImage& image, const ErrorScale& scale, ThreadPool& pool)
{
    const FoundErrors errors(image, true, pool);
    return {estimate_error(image, "beauty", errors, true, scale, pool),
            estimate_error(image, "indirect", errors, false, scale, pool)};
}

ErrorEstimate estimate_picture_error(const LayeredImage& image, const ErrorScale& scale, ThreadPool& pool)
{
    return estimate_error(image, "beauty", {image, true, pool}, true, scale, pool);
}

ErrorEstimate estimate_indirect_error(const LayeredImage& image, const ErrorScale& scale, ThreadPool& pool)
{
    return estimate_error(image, "indirect", {image, false, pool}, false, scale, pool);
}

}  // namespace rcs
