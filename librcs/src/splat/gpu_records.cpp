#include "splat/gpu_records.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "radiance/harmonics.h"
#include "util/color.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

// Positions in the G-buffer and in GpuRecord are floats relative to the camera: each may be off by half a
// unit in the last place of each coordinate, together below 3 x 2^-24 of the distance, and the weight rounds
// about as much again. A sphere larger by that much covers every pixel to which float arithmetic gives a
// weight.
constexpr double kPositionRounding = 8 * 0x1p-24;

/// The irradiance of uniform radiance that has an irradiance of 1, by the order of harmonics: the clamped cosine about
/// the normal has zonal coefficients (Ramamoorthi and Hanrahan 2001); over its irradiance pi.
constexpr float kCosine[kBands] = {1.0f, 2.0f / 3.0f, 0.25f, 0.0f, -1.0f / 24.0f, 0.0f};

/// Over the irradiance: extrapolated irradiance times these is extrapolated radiance.
/// @param records  1 to kHarmonicLanes   @param out  one for each
RCS_MULTIVERSION
void relative_radiance(std::span<const Record* const> records, gpu::GpuRadiance* out)
{
    float x[kHarmonicLanes], y[kHarmonicLanes], z[kHarmonicLanes];
    for (std::size_t l = 0; l < kHarmonicLanes; ++l) {
        const glm::vec3 n = records[std::min(l, records.size() - 1)]->normal;
        x[l] = n.x, y[l] = n.y, z[l] = n.z;
    }
    HarmonicLanes about_normal;
    evaluate_harmonics(detail::harmonic_factors(), x, y, z, about_normal);
    for (std::size_t k = 0; k < records.size(); ++k) {
        constexpr auto kCount = static_cast<std::size_t>(kHarmonics);
        const Record& r = *records[k];
        std::array<float, 4 * kCount> all{};
        for (std::size_t c = 0; c < 3; ++c) {
            const float e = r.irradiance[static_cast<int>(c)];
            if (!(e > 0.0f) || r.radiance.empty()) continue;
            const float* radiance = r.radiance.data() + c * kCount;
            RCS_WHOLE_LOOP
            for (std::size_t i = 0; i < kCount; ++i) all[c * kCount + i] = radiance[i] / e;
        }
        for (std::size_t l = 0; l < kBands; ++l)
            for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i)
                all[3 * kCount + i] = kCosine[l] * about_normal[i][k];
        out[k] = std::bit_cast<gpu::GpuRadiance>(all);
    }
}

/// @return whether the record reaches the image
bool set(const Record& record, glm::dvec3 camera_position, const View& view, const SplatSettings& options,
         float per_unit, gpu::GpuRecord& out)
{
    const float radius = influence_radius(record, options.overlap);
    const glm::dvec3 relative = glm::dvec3(record.position) - camera_position;
    const double padding = kPositionRounding * (glm::length(relative) + 2.0 * radius);
    const PixelBounds bounds = sphere_bounds(view, relative, radius + padding);
    if (bounds.empty() || !(radius > 0.0f)) return false;

    out.position = glm::vec4(glm::vec3(relative), 1.0f / radius);
    out.normal = glm::vec4(record.normal, 1.0f / (options.error_tolerance * options.overlap));
    out.irradiance = glm::vec4(record.irradiance + record.correction, per_unit);
    for (std::size_t color = 0; color < 3; ++color) {
        out.rotation_gradient[color] = glm::vec4(record.rotation_gradient[color], 0.0f);
        out.translation_gradient[color] = glm::vec4(record.gradient_scale * record.translation_gradient[color], 0.0f);
    }
    const float deviation = record.noise * luminance(record.irradiance) * per_unit;
    out.rotation_gradient[0].w = deviation * deviation;
    out.pixels = {bounds.x0, bounds.y0, bounds.x1, bounds.y1};
    return true;
}

}  // namespace

float influence_radius(const Record& record, float overlap)
{
    const float wide = std::max(std::min(2.0f, overlap), overlap * record.gradient_scale);
    return record.spacing_radius * std::max(1.0f, record.breadth * wide);
}

void append_gpu_records(std::span<const Record> records, glm::dvec3 camera_position, const View& view,
                        const SplatSettings& options, bool with_radiance, float luminance_unit, GpuRecords& gpu_records)
{
    std::vector<const Record*> that_reach;
    for (const Record& record : records) {
        gpu::GpuRecord out{};
        if (!set(record, camera_position, view, options, 1.0f / luminance_unit, out)) continue;
        gpu_records.records.push_back(out);
        if (with_radiance) that_reach.push_back(&record);
    }
    const std::size_t known = gpu_records.radiance.size();
    gpu_records.radiance.resize(known + that_reach.size());
    for (std::size_t first = 0; first < that_reach.size(); first += kHarmonicLanes)
        relative_radiance(
            std::span(that_reach).subspan(first, std::min<std::size_t>(kHarmonicLanes, that_reach.size() - first)),
            &gpu_records.radiance[known + first]);
}

gpu::GpuRecord make_gpu_record(const Record& record, glm::dvec3 camera_position, const View& view,
                               const SplatSettings& options)
{
    gpu::GpuRecord out{};
    set(record, camera_position, view, options, 1.0f, out);
    return out;
}

float luminance_unit(std::span<const Record> records)
{
    double sum = 0.0;
    for (const Record& r : records) sum += static_cast<double>(luminance(r.irradiance));
    const float mean = records.empty() ? 0.0f : static_cast<float>(sum / static_cast<double>(records.size()));
    return mean > 0.0f && std::isfinite(1.0f / mean) ? mean : 1.0f;
}

GpuRecords make_gpu_records(std::span<const Record> records, glm::dvec3 camera_position, const View& view,
                            const SplatSettings& options, bool with_radiance, float luminance_unit, ThreadPool& pool)
{
    constexpr std::size_t kChunk = 2048;
    std::vector<GpuRecords> chunks((records.size() + kChunk - 1) / kChunk);
    pool.parallel_for(records.size(), kChunk, [&](std::size_t begin, std::size_t end, int) {
        append_gpu_records(records.subspan(begin, end - begin), camera_position, view, options, with_radiance,
                           luminance_unit, chunks[begin / kChunk]);
    });
    GpuRecords all;
    all.records.reserve(records.size());
    for (const GpuRecords& chunk : chunks) {
        all.records.insert(all.records.end(), chunk.records.begin(), chunk.records.end());
        all.radiance.insert(all.radiance.end(), chunk.radiance.begin(), chunk.radiance.end());
    }
    return all;
}

}  // namespace rcs
