#pragma once

#include <span>
#include <vector>

#include "rcs/splat.h"
#include "shared/gpu_record.h"

namespace rcs {

/// Influence of records as quads and tiles read them.
struct GpuRecords {
    std::vector<gpu::GpuRecord> records;
    std::vector<gpu::GpuRadiance> radiance;  ///< one for each record, or empty
};

/// How far a record reaches in a splat of this overlap [m]. With 1 that is its spacing radius, and it is never less.
float influence_radius(const Record& record, float overlap);

/// Appends the records that reach the image, in their order, as quads and tiles read them.
/// @param camera_position  what positions are relative to, as in the G-buffer
/// @param luminance_unit  SplatBuffer::luminance_unit
void append_gpu_records(std::span<const Record> records, glm::dvec3 camera_position, const View& view,
                        const SplatSettings& options, bool with_radiance, float luminance_unit,
                        GpuRecords& gpu_records);

/// Those records as quads and tiles read them. @param pool  they are made in parallel
GpuRecords make_gpu_records(std::span<const Record> records, glm::dvec3 camera_position, const View& view,
                            const SplatSettings& options, bool with_radiance, float luminance_unit, ThreadPool& pool);

/// A record for weights alone; one that does not reach the image has an empty rectangle.
gpu::GpuRecord make_gpu_record(const Record& record, glm::dvec3 camera_position, const View& view,
                               const SplatSettings& options);

/// Mean luminance of the records' irradiance, so that its squares stay within floats; 1 if all is dark. [W m^-2]
float luminance_unit(std::span<const Record> records);

}  // namespace rcs
