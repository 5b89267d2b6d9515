#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rcs/gbuffer.h"
#include "rcs/records.h"

namespace rcs {

/// Takes away the records that lie outside of the picture and do not reach into it. The others stay in their order.
std::vector<Record> take_unseen(const View& view, std::vector<Record>& records);

/// Gives records that another view has made the footprints that pixels of this one have there: how close records lie
/// follows from them. Records out of sight keep theirs unless a pixel at their distance is much smaller. Nothing
/// changes for records of the same view.
/// @param view  the view that `gbuffer` was made for
void fit_to_view(const GBuffer& gbuffer, const View& view, std::span<Record> records);

/// Records that lie on what is seen, and can be gathered again, come after the others.
/// @param with_radiance  whether those that gathers now make hold radiance: others do not go together with them
/// @return the pixel of each of those, in their order
std::vector<std::uint32_t> bring_seen_last(const GBuffer& gbuffer, const View& view, bool with_radiance,
                                           std::vector<Record>& records);

}  // namespace rcs
