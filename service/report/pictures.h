#pragma once

#include <vector>

#include "rcs/camera.h"
#include "rcs/image.h"
#include "rcs/records.h"

namespace rcs::service {

/// Relative difference at which the colours of difference_picture() end.
inline constexpr float kLargestDifference = 0.5f;

/// A heat map: black where nothing differs, towards orange and white where the image is too bright, towards blue where
/// it is too dark; magenta where it is not finite. Display RGB.
/// @param difference  one channel, as relative_difference() gives it
Image difference_picture(const Image& difference);

/// Where the records lie: the picture in dim grey, a dot for each record. Display RGB.
Image records_picture(const Image& display, const View& view, const std::vector<Record>& records);

}  // namespace rcs::service
