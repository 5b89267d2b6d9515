#pragma once

#include <memory>

#include "lit_points/gather_guide.h"
#include "rcs/records.h"

namespace rcs {

/// Prepares gathers that know where the light is: finds lit points, and measures at visible points what part of a
/// gather's rays is best spent on looks at them, for the least error in the same time.
/// @return null: rays find all light as well
std::unique_ptr<GatherGuide> make_gather_guide(const LitScene& scene, const GBuffer& gbuffer, const View& view,
                                               const RecordSettings& settings, ThreadPool& pool);

}  // namespace rcs
