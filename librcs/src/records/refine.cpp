#include "records/refine.h"

#include <algorithm>
#include <cmath>

#include "util/color.h"

namespace rcs {
namespace {

constexpr int kMostRays = 2048;  // per record, unless the options ask for more
// A neighbourhood is what the final splat averages over.
constexpr float kNeighbourhood = 3.0f;
// Below this part of the mean irradiance, noise is judged against the part: it is too dark to be seen.
constexpr float kDark = 0.01f;

/// Irradiance and its variance in the place of two colours, so that a splat averages them.
std::vector<Record> as_noise_records(std::span<const Record> records)
{
    std::vector<Record> noise(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        const Record& r = records[i];
        const float e = luminance(r.irradiance);
        noise[i].position = r.position;
        noise[i].normal = r.normal;
        noise[i].irradiance = {e, r.noise * r.noise * e * e, 0.0f};
        noise[i].spacing_radius = r.spacing_radius;
        noise[i].gradient_scale = r.gradient_scale;
    }
    return noise;
}

struct Around {
    float irradiance;  // mean of the neighbours
    float variance;    // of the weighted mean that the splat makes here
};

/// What the splat holds at the record's own pixel, without the record: there it counts with weight 1.
Around without_self(const SplatBuffer& sums, std::uint32_t pixel, const Record& self)
{
    const float weight = sums.weight[pixel] - 1.0f;
    if (!(weight > 0.1f))
        return {self.irradiance.x, self.irradiance.y};
    return {std::max(0.0f, sums.weighted_r[pixel] - self.irradiance.x) / weight,
            std::max(0.0f, sums.weighted_g[pixel] - self.irradiance.y) / (weight * sums.weight[pixel])};
}

}  // namespace

void refine_noisy_records(const RecordGatherer& gatherer, const GBuffer& gbuffer, const TiledSurfaces& surfaces,
                          const View& view, const RecordOptions& options, std::span<const std::uint32_t> pixels,
                          ThreadPool& pool, std::vector<Record>& records, RecordStats& stats)
{
    if (pixels.empty())
        return;
    const std::vector<Record> noise = as_noise_records(records);
    SplatStats uncounted;
    const SplatBuffer sums =
        splat_tiles(noise, surfaces, view, {options.error_tolerance, kNeighbourhood}, pool, uncounted);
    const std::size_t first = records.size() - pixels.size();
    std::vector<Around> around(pixels.size());
    double mean = 0.0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        around[i] = without_self(sums, pixels[i], noise[first + i]);
        mean += static_cast<double>(around[i].irradiance) / static_cast<double>(pixels.size());
    }
    std::vector<int> extra(pixels.size());
    const float most = static_cast<float>(std::max(1, kMostRays / options.rays));
    const float target2 = options.noise_target * options.noise_target;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const float e = around[i].irradiance + kDark * static_cast<float>(mean);
        const float gathers = e > 0.0f ? std::ceil(around[i].variance / (target2 * e * e)) : 1.0f;
        extra[i] = static_cast<int>(std::clamp(gathers, 1.0f, most)) - 1;
    }
    gatherer.gather_more(gbuffer, pixels, extra, std::span(records).subspan(first), pool, stats);
}

}  // namespace rcs
