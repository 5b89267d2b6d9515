#pragma once

#include "glossy/traced_lobes.h"
#include "hit_light/hit_radiance.h"
#include "render/frame.h"

namespace rcs {

/// Parts the lamps between shadow rays and records, whose light is one kind in all records there are.
void part_lamps(Frame& frame);

/// Light that leaves what rays hit.
HitRadiance light_of_hits(const Frame& frame);
/// What gathers at contacts see, and how they gather: the same picture by records that were gathered here, or read from
/// a file, so that nothing counts that these taught.
LitScene light_at_contacts(Frame& frame);
RecordSettings contact_gathers(const Frame& frame);
void gather_contacts(Frame& frame);
/// Of pixels where surfaces meet, closer than records lie.
void ask_contacts(Frame& frame);
/// Of pixels whose records disagree about gathered lamps.
void ask_lamps(Frame& frame);
/// Of one round of rays along narrow lobes. @param round  0: the first
LobeSettings lobe_settings(const Frame& frame, int round);
/// How many more rounds each pixel is to have: the records' light and one round are known.
std::vector<std::uint8_t> noisy_lobes(const Frame& frame);
/// Settles whether narrow lobes look at lit points as well.
void choose_looks(Frame& frame);

}  // namespace rcs
