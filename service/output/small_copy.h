#pragma once

#include "rcs/image.h"

namespace rcs::service {

/// Averages blocks of pixels until neither side is longer. @param side  [px]
Image small_copy(const Image& image, int side);

}  // namespace rcs::service
