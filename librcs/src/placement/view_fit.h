#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rcs/gbuffer.h"
#include "rcs/records.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// How many pixels of this view a length at a record may take up, as it faces the viewer or as the record knows [px].
double reach_in_pixels(const View& view, const Record& record, double length);

/// Takes away the records that lie outside of the picture and do not reach into it. The others stay in their order.
std::vector<Record> take_unseen(const View& view, std::vector<Record>& records);

/// Records that were taken from between others.
struct TakenOut {
    std::vector<Record> records;
    std::vector<std::uint8_t> is_left;  ///< of those that there were, 1 for each that was left
};
/// Takes away the records that neither reach any covered pixel nor lie beside such as do: of what little shows through
/// other surfaces most records tell nothing.
TakenOut take_elsewhere(const GBuffer& gbuffer, const View& view, ThreadPool& pool, std::vector<Record>& records);
/// Puts them where they were; what has come since stays behind them.
void put_between(TakenOut taken, std::vector<Record>& records);

/// Gives records that another view has made the footprints that pixels of this one have there: how close records lie
/// follows from them. Records out of sight keep theirs unless a pixel at their distance is much smaller. Nothing
/// changes for records of the same view.
/// @param view  the view that `gbuffer` was made for
/// @param of_such_pictures  they come from views whose pixels are as wide: footprints stay within 1.5 times of the
/// pixels', lest light flickers as the camera moves; else within 1.1 times
void fit_to_view(const GBuffer& gbuffer, const View& view, bool of_such_pictures, std::span<Record> records);

/// Records that lie on what is seen, and can be gathered again, come after the others.
/// @param with_radiance  whether those that gathers now make hold radiance: others do not go together with them
/// @return the pixel of each of those, in their order
std::vector<std::uint32_t> bring_seen_last(const GBuffer& gbuffer, const View& view, bool with_radiance,
                                           std::vector<Record>& records);

}  // namespace rcs
