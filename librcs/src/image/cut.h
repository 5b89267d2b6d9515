#pragma once

#include <algorithm>

#include "rcs/image.h"

namespace rcs {

/// The window of an image whose upper left corner is (x, y), within it.
inline Image cut(const Image& image, int x, int y, int width, int height)
{
    Image part(width, height, image.channels);
    for (int row = 0; row < height; ++row) {
        const float* const from = image.at(x, y + row);
        std::copy(from, from + static_cast<std::ptrdiff_t>(width) * image.channels, part.at(0, row));
    }
    return part;
}

}  // namespace rcs
