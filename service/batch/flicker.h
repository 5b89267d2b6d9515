#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "rcs/image.h"

/// How much light flickers from frame to frame where nothing says that it should.
namespace rcs::service {

/// A frame as it is looked at.
struct FlickerFrame {
    Image light;                  ///< a layer; its luminance counts
    std::optional<Image> motion;  ///< where points came from, as the layer motion says; none: nothing moved
    std::optional<Image> depth;   ///< tells points that were hidden in the frame before; with motion only
    std::optional<Image> normal;  ///< tells points between surfaces that face different ways; with motion only
};

/// How points deviate in time, relative to their mean.
struct Deviations {
    double mean = 0.0, median = 0.0, p95 = 0.0;
};

/// What of a picture is looked at. @param layer  whose light; one that it has
FlickerFrame flicker_frame(const LayeredImage& picture, const std::string& layer);

/// Over points that show in all frames, each followed from the last frame back to the first.
struct Flicker {
    std::size_t points = 0;
    Deviations all;                    ///< standard deviations
    std::optional<Deviations> sudden;  ///< from frame to frame: what leaves out light that changes steadily, by
                                       ///< deviations from the mean of the frames before and after, scaled so that it
                                       ///< is `all` where frames have nothing in common; none: there are two frames
    std::vector<std::optional<double>> steps;  ///< change_between() of each frame and the one before it
};

/// @param frames  two or more of the same size @throws rcs::Error bad_argument
Flicker measure_flicker(const std::vector<FlickerFrame>& frames);

/// Mean over points of |after - before| / (sqrt(2) (their mean + 1 % of the picture's)): of frames whose noise has
/// nothing in common about the standard deviation of one, relative to its value, times 0.8. None: no point shows in
/// both.
std::optional<double> change_between(const FlickerFrame& before, const FlickerFrame& after);

}  // namespace rcs::service
