#pragma once

#include <memory>

#include "cells/direct_cells.h"
#include "lit_points/arrival_map.h"
#include "lit_points/gather_guide.h"
#include "rcs/records.h"

namespace rcs {

/// What gathers know of where the light is.
struct LightSearch {
    std::unique_ptr<GatherGuide> guide;    ///< to lit points; null: rays find all light as well
    std::unique_ptr<DirectCells> direct;   ///< where rays end; null: shadow rays tell as much
    std::unique_ptr<ArrivalMap> arrivals;  ///< where rays are aimed; null: they go everywhere
};

/// Prepares gathers that know where the light is. Measures at visible points whether it pays to light the surfaces that
/// rays end on once for all, and what part of a gather's rays is best spent on looks at lit points, for the least error
/// in the same time.
/// @param steady  nothing in the scene will move: the surfaces may be lit once for all. Rays are aimed in either case:
/// what is known of another moment's light is as right, if not as good.
LightSearch search_light(const LitScene& scene, const GBuffer& gbuffer, const View& view,
                         const RecordSettings& settings, bool steady, ThreadPool& pool);

}  // namespace rcs
