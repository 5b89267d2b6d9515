#include "report/pictures.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <glm/glm.hpp>

namespace rcs::service {
namespace {

void store(Image& image, int x, int y, glm::vec3 color)
{
    for (int c = 0; c < 3; ++c) image.at(x, y)[c] = color[c];
}

glm::vec3 difference_color(float value)
{
    if (!std::isfinite(value)) return {1.0f, 0.0f, 1.0f};
    const float t = std::min(std::abs(value) / kLargestDifference, 1.0f);
    const glm::vec3 middle = value > 0.0f ? glm::vec3(0.90f, 0.35f, 0.05f) : glm::vec3(0.05f, 0.40f, 0.90f);
    const glm::vec3 end = value > 0.0f ? glm::vec3(1.0f, 0.95f, 0.70f) : glm::vec3(0.75f, 0.95f, 1.0f);
    return t < 0.5f ? 2.0f * t * middle : glm::mix(middle, end, 2.0f * t - 1.0f);
}

}  // namespace

Image difference_picture(const Image& difference)
{
    Image picture(difference.width, difference.height, 3);
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) store(picture, x, y, difference_color(*difference.at(x, y)));
    }
    return picture;
}

Image records_picture(const Image& display, const View& view, const std::vector<Record>& records)
{
    Image picture(display.width, display.height, 3);
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const float* p = display.at(x, y);
            store(picture, x, y, glm::vec3(0.55f * (0.3f * p[0] + 0.6f * p[1] + 0.1f * p[2])));
        }
    }
    for (const Record& record : records) {
        const std::optional<glm::dvec2> at =
            image_position(view, glm::dvec3(record.position) - camera_position(view.camera));
        if (!at || at->x < 0.0 || at->y < 0.0 || at->x >= picture.width || at->y >= picture.height) continue;
        store(picture, static_cast<int>(at->x), static_cast<int>(at->y), {1.0f, 0.85f, 0.2f});
    }
    return picture;
}

}  // namespace rcs::service
