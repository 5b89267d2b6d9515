#pragma once

#include <cstddef>
#include <vector>

#include "rcs/splat.h"

namespace rcs {

/// splat_gpu_tiles() of splat.h, with so many bytes of records on the device at a time: the sums of one part go on
/// where those of the last ended, so that the parts change no bit.
SplatBuffer splat_gpu_tiles(GlContext& gl, const std::vector<Record>& records, const GBuffer& gbuffer, const View& view,
                            const SplatSettings& options, SplatStats& stats, const Shading* glossy,
                            std::size_t block_bytes);

}  // namespace rcs
