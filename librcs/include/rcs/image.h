#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace rcs {

/// Interleaved float pixels, row by row, origin at the top left.
struct Image {
    int width = 0;              ///< [px]
    int height = 0;             ///< [px]
    int channels = 0;           ///< 1 (scalar), 3 (RGB or vector), 4 (RGBA)
    std::vector<float> pixels;  ///< width x height x channels

    Image() = default;
    /// A black one.
    Image(int width_, int height_, int channels_)
        : width(width_),
          height(height_),
          channels(channels_),
          pixels(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) *
                 static_cast<std::size_t>(channels_))
    {
    }

    /// The channels of a pixel.
    float* at(int x, int y)
    {
        return pixels.data() +
               (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
                   static_cast<std::size_t>(channels);
    }
    /// The same to be read.
    const float* at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
};

/// Where an image lies in the picture that it is a part of [px].
struct ImageWindow {
    int x = 0;             ///< column of its upper left corner
    int y = 0;             ///< row of its upper left corner
    int whole_width = 0;   ///< of the picture
    int whole_height = 0;  ///< of the picture

    /// Whether they are the same part of pictures of the same size.
    bool operator==(const ImageWindow&) const = default;
};

/// The layers of one rendered view, all of the same size, by the names of all_layers() (rcs/layers.h): docs/layers.md
/// says what each holds. "beauty" is always there.
struct LayeredImage {
    std::map<std::string, Image> layers;          ///< by name
    std::optional<ImageWindow> window;            ///< of a crop; an EXR's data and display window
    std::map<std::string, std::string> metadata;  ///< settings, seed, version; kept in EXR
    /// ... of single layers, by their names; in EXR files that hold the layer.
    std::map<std::string, std::map<std::string, std::string>> layer_metadata;
};

}  // namespace rcs
