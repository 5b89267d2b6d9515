#pragma once

#include <cstddef>
#include <vector>

#include "rcs/splat.h"

namespace rcs {

/// What does a splat by tiles on the device, and how many bytes of records are there at a time.
struct TileDevice {
    GlContext& gl;
    ThreadPool& pool;
    std::size_t block_bytes;
};

/// splat_gpu_tiles() of splat.h; the sums of one part of the records go on where those of the last ended, so that the
/// parts change no bit.
SplatBuffer splat_gpu_tiles(const TileDevice& device, const std::vector<Record>& records, const GBuffer& gbuffer,
                            const View& view, const SplatSettings& options, SplatStats& stats, const Shading* glossy);

}  // namespace rcs
