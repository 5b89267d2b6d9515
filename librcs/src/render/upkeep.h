#pragma once

namespace rcs {

struct Frame;

/// Records of earlier scenes, and gathers at contacts, come to know the scene of now.
void bring_up_to_date(Frame& frame);

}  // namespace rcs
