#pragma once

namespace rcs {

struct Frame;

/// Records of earlier scenes come to know the scene of now.
void bring_up_to_date(Frame& frame);
/// ... and so do gathers at contacts that the view's pixels show.
void renew_contacts(Frame& frame);

}  // namespace rcs
