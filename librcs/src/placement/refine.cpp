#include "placement/refine.h"

#include <algorithm>
#include <cmath>

#include "splat/at_pixels.h"
#include "util/color.h"

namespace rcs {
namespace {

// Below this part of the mean irradiance, noise is judged against the part: it is too dark to be seen.
constexpr float kDark = 0.01f;
// So many times `rays` a record has where noise is what is allowed, had it been gathered with those.
constexpr float kAtAllowed = 2.0f;
// Neighbours that weigh less in all say nothing.
constexpr float kLeastWeight = 0.1f;

/// A record's variance relative to its irradiance, had it been gathered with so many rays.
float variance_with(const Record& r, int rays, float fall)
{
    return r.noise * r.noise * std::pow(static_cast<float>(r.rays) / static_cast<float>(rays), 2.0f * fall);
}

float mean_variance(std::span<const Record> records, int rays, float fall)
{
    double sum = 0.0;
    for (const Record& r : records) sum += static_cast<double>(variance_with(r, rays, fall));
    return static_cast<float>(sum / static_cast<double>(records.size()));
}

/// Irradiance in units of `mean`, and its variance, in the place of two colours, so that a splat averages them.
std::vector<Record> as_noise_records(std::span<const Record> records, int rays, float fall, double mean)
{
    std::vector<Record> noise(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        const Record& r = records[i];
        const float e = static_cast<float>(static_cast<double>(luminance(r.irradiance)) / mean);
        noise[i].position = r.position;
        noise[i].normal = r.normal;
        noise[i].irradiance = {e, variance_with(r, rays, fall) * e * e, 0.0f};
        noise[i].spacing_radius = r.spacing_radius;
        noise[i].gradient_scale = r.gradient_scale;
    }
    return noise;
}

/// Variance, relative to the irradiance, of the weighted mean that the splat makes at a record's own pixel, by what
/// it holds there without the record, which counts with weight 1.
/// @param typical  what is taken for it where no other record reaches
float variance_around(const PixelSums& sums, std::size_t i, const Record& self, float typical)
{
    const float weight = sums.weight[i] - 1.0f;
    if (!(weight > kLeastWeight)) return typical;
    // A weight is never more than 1, so where all others are dark nothing is left of the record by rounding.
    const float e = std::max(0.0f, sums.weighted[i].x - self.irradiance.x) / weight + kDark;
    const float variance = std::max(0.0f, sums.weighted[i].y - self.irradiance.y) / weight;
    return variance / (sums.weight[i] * e * e);
}

}  // namespace

double mean_irradiance(std::span<const Record> records)
{
    double sum = 0.0;
    for (const Record& r : records) sum += static_cast<double>(luminance(r.irradiance));
    return sum / static_cast<double>(std::max<std::size_t>(1, records.size()));
}

std::vector<float> noise_around(int rays, const GBuffer& gbuffer, const View& view, float error_tolerance,
                                std::span<const std::uint32_t> pixels, ThreadPool& pool,
                                std::span<const Record> records, float fall)
{
    std::vector<float> around(pixels.size(), 0.0f);
    const double mean = pixels.empty() ? 0.0 : mean_irradiance(records);
    if (!(mean > 0.0)) return around;
    const std::vector<Record> noise = as_noise_records(records, rays, fall, mean);
    const PixelSums sums =
        splat_at_pixels(noise, gbuffer, pixels, view, {error_tolerance, kNeighbourhood, false}, pool);
    const std::size_t first = records.size() - pixels.size();
    const float typical = mean_variance(records, rays, fall);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        around[i] = std::sqrt(variance_around(sums, i, noise[first + i], typical));
    return around;
}

float noise_allowed(const Record& record, float widest)
{
    // Those that lie closer than usual, since their extrapolations disagree, count for half as much closer.
    const float apart = record.spacing_radius / (record.footprint * std::sqrt(record.closeness));
    return apart < widest ? std::pow(widest / apart, 2.0f / 3.0f) : 1.0f;
}

std::vector<int> extra_gathers(std::span<const Record> records, std::span<const float> noise, int rays,
                               float noise_target, float widest, int most_rays)
{
    std::vector<int> extra(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        const float excess = noise[i] / (noise_target * noise_allowed(records[i], widest));
        const float gathers = static_cast<float>(records[i].rays) / static_cast<float>(rays);
        const float most = std::max(0.0f, static_cast<float>(most_rays) / static_cast<float>(rays) - gathers);
        extra[i] = static_cast<int>(std::clamp(std::round(kAtAllowed * excess) - gathers, 0.0f, most));
    }
    return extra;
}

}  // namespace rcs
