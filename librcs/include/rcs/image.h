#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace rcs {

/// Interleaved float pixels, row by row, origin at the top left.
struct Image {
    int width = 0;
    int height = 0;
    int channels = 0;  ///< 1 (scalar), 3 (RGB or vector), 4 (RGBA)
    std::vector<float> pixels;

    Image() = default;
    Image(int width_, int height_, int channels_)
        : width(width_),
          height(height_),
          channels(channels_),
          pixels(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) *
                 static_cast<std::size_t>(channels_))
    {
    }

    float* at(int x, int y)
    {
        return pixels.data() +
               (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
                   static_cast<std::size_t>(channels);
    }
    const float* at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
};

/// The layers of one rendered view, all of the same size, by name. "beauty" is always there.
///
/// | name            | channels | what                                                             |
/// | --------------- | -------- | ---------------------------------------------------------------- |
/// | beauty          | 4        | scene-linear radiance = emission + direct + indirect; alpha cover |
/// | emission        | 3        | radiance emitted towards the camera, background included         |
/// | direct          | 3        | reflected direct light of lamps                                  |
/// | indirect        | 3        | reflected indirect light, irradiance times albedo over pi        |
/// | indirect_error  | 1        | standard error of indirect's luminance, estimated (error_estimate.h) |
/// | irradiance      | 3        | indirect irradiance [W m^-2]                                     |
/// | albedo          | 3        | diffuse reflectance                                              |
/// | normal          | 3        | shading normal, world space                                      |
/// | depth           | 1        | distance from the camera [m]; +inf where nothing is seen         |
/// | records         | 1        | records whose influence covers the pixel                         |
/// | standard_error  | 3        | of beauty (reference only)                                       |
struct LayeredImage {
    std::map<std::string, Image> layers;
    std::map<std::string, std::string> metadata;  ///< settings, seed, version; kept in EXR
};

}  // namespace rcs
