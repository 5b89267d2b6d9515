#pragma once

#include <cstdint>

#include "render/frame.h"

namespace rcs {

/// Whether views of the session go on from one another's samples. What a goal takes is told by pixels that are spared
/// none.
bool goes_on(const Frame& frame);

/// Finds where the view before saw this pass's points, if it saw the same scene and sampled it alike: its samples are
/// known there. The light that neither records nor samples share is all that pixels pay for then.
void look_back(Frame& frame);

/// Keeps what this pass's pixels have sampled, for the view after.
void keep_samples(Frame& frame);

}  // namespace rcs
