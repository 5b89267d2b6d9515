#pragma once

#include "rcs/camera.h"
#include "rcs/number_range.h"

/// Ranges of what goes with a job but is no option of the render (docs/options.md): for commands and messages alike.
namespace rcs::service {

inline constexpr NumberRange kExposures{-64, 64};                           ///< [EV]
inline constexpr NumberRange kLensShifts{-kMostLensShift, kMostLensShift};  ///< each part [heights of the picture]
inline constexpr NumberRange kRotations{-360, 360};                         ///< of the sky [degrees]
inline constexpr double kLargestCoordinate =
    1e18;  ///< of cameras, as of a scene's matrices: Embree takes no larger ones
inline constexpr NumberRange kJpegQualities{1, 100};
inline constexpr NumberRange kShutters{0, 1e6};  ///< how long one is open [s]

}  // namespace rcs::service
