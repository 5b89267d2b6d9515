#pragma once

#include <span>

namespace rcs {

/// Standard deviation of the blur after which an error counts as cloud [pixels]: at FLIP's 67 pixels a degree what is
/// left of noise has a period of a degree or so, below the 3 to 5 periods a degree that the eye sees best, and is seen
/// as shape, not as grain.
inline constexpr double kCloudBlur = 8.0;

/// What a Gaussian of kCloudBlur pixels leaves of an error.
struct LowFrequency {
    double error = 0.0;  ///< mean of the blurred error's absolute value
    /// `error` over what it would be if the errors of pixels were as large, normally distributed, and knew nothing of
    /// each other: 1 for white noise, 28 for a patch much wider than the blur (in a large picture); 0 without error.
    double over_white_noise = 0.0;
};

/// @param error  width x height signed errors, row by row; what is NaN is left out
LowFrequency low_frequency(std::span<const double> error, int width, int height);

}  // namespace rcs
