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

/// Appends the records that reach the image, in their order, as quads and tiles read them.
/// @param camera_position  what positions are relative to, as in the G-buffer
void append_gpu_records(std::span<const Record> records, glm::dvec3 camera_position, const View& view,
                        const SplatOptions& options, bool with_radiance, GpuRecords& gpu_records);

}  // namespace rcs
