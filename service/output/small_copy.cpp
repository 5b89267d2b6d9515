#include "output/small_copy.h"

#include <algorithm>

namespace rcs::service {

Image small_copy(const Image& image, int side)
{
    const int step = std::max(1, (std::max(image.width, image.height) + side - 1) / side);
    Image copy((image.width + step - 1) / step, (image.height + step - 1) / step, image.channels);
    for (int y = 0; y < copy.height; ++y) {
        for (int x = 0; x < copy.width; ++x) {
            const int x1 = std::min(image.width, (x + 1) * step), y1 = std::min(image.height, (y + 1) * step);
            const float part = 1.0f / static_cast<float>((x1 - x * step) * (y1 - y * step));
            for (int v = y * step; v < y1; ++v) {
                for (int u = x * step; u < x1; ++u) {
                    for (int c = 0; c < image.channels; ++c) copy.at(x, y)[c] += part * image.at(u, v)[c];
                }
            }
        }
    }
    return copy;
}

}  // namespace rcs::service
