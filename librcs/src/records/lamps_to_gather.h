#pragma once

#include "lamps/gathered_lamps.h"
#include "rcs/gbuffer.h"
#include "rcs/records.h"

namespace rcs {

/// The lamps that a view's records should gather: those that would fill much of the sky over what is seen, and of which
/// little gets there. Shadow rays of pixels would mostly miss them, and their shadows are soft.
GatheredLamps lamps_to_gather(const LitScene& scene, const GBuffer& gbuffer, const RecordSettings& settings,
                              ThreadPool& pool);

/// What gathered lamps alone send to records, and how it changes: as all they receive does.
std::vector<Record> of_gathered_lamps(const std::vector<Record>& records);

}  // namespace rcs
