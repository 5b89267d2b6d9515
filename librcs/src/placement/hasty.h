#pragma once

#include <cstdint>
#include <vector>

#include "rcs/records.h"
#include "rcs/splat.h"

namespace rcs {

/// A view that there is little time for.
struct HastyView {
    const LitScene& scene;
    const GBuffer& gbuffer;
    const View& view;
    const RecordSettings& records;
    const SplatSettings& splat;  ///< that showed the holes
};

/// Gathers where no record reaches at all: at a pixel of each cell of ever finer grids, for as long as there is time.
/// Other records are not looked at: how close these may come to them is found out when they are placed.
/// @param seconds  > 0; one batch is gathered in any case
/// @param weight  per pixel, of the splat: > 0 where a record reaches; that of the new ones is added
/// @return the new ones
std::vector<Record> gather_in_haste(const HastyView& at, double seconds, ThreadPool& pool, std::vector<float>& weight,
                                    RecordStats& stats);

/// Gives visible pixels that no record reaches the light of those around that one does: means over ever larger squares.
/// @return those pixels
std::vector<std::uint32_t> fill_from_around(const GBuffer& gbuffer, SplatBuffer& sums);

}  // namespace rcs
