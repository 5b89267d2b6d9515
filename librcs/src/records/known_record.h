// What is asked of a record alone, and what a further gather makes of it.
#pragma once

#include "rcs/records.h"

namespace rcs {

/// Whether it is known where its rays start.
bool is_born(const Record& record);

/// How far the record's first-order expansion stays sensible: where its light would reach zero or twice its value [m].
float gradient_reach(const Record& record);

/// Averages a further gather at the record's place into its irradiance, gradients, radiance and noise, by numbers of
/// rays. What the spacing rests on stays: else records would claim other pixels than those filled around them.
void add_gather(Record& record, const Record& more);

}  // namespace rcs
