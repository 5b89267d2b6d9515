#pragma once

#include <span>
#include <vector>

#include "rcs/splat.h"
#include "shared/gpu_record.h"

namespace rcs {

/// Appends the records that reach the image, in their order, as quads and tiles read them.
/// @param camera_position  what positions are relative to, as in the G-buffer
void append_gpu_records(std::span<const Record> records, glm::dvec3 camera_position, const View& view,
                        const SplatOptions& options, std::vector<gpu::GpuRecord>& gpu_records);

}  // namespace rcs
