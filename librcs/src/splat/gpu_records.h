#pragma once

#include <vector>

#include "rcs/splat.h"
#include "shared/gpu_record.h"

namespace rcs {

/// The records that reach the image, in their order, as quads and tiles read them.
/// @param view  the view that `gbuffer` was made for
std::vector<gpu::GpuRecord> make_gpu_records(const std::vector<Record>& records, const GBuffer& gbuffer,
                                             const View& view, const SplatOptions& options);

}  // namespace rcs
