#include "scene/lens.h"

#include <cmath>
#include <numbers>

namespace rcs {

Lens lens_of(const Camera& camera, double f_stop, double focus)
{
    const double focal_length = 0.5 * kFilmHeight / std::tan(0.5 * camera.yfov);
    return {focal_length / f_stop, focus};
}

Camera through_lens(Camera camera, const Lens& lens, glm::dvec2 point)
{
    const glm::dvec2 beside = 0.5 * lens.diameter * point;
    camera.world_from_view[3] += beside.x * camera.world_from_view[0] + beside.y * camera.world_from_view[1];
    camera.lens_shift -= beside / (lens.focus * 2.0 * std::tan(0.5 * camera.yfov));
    return camera;
}

glm::dvec2 lens_point(int pass)
{
    // A sequence like that of pixel offsets, with steps of its own, brought to the disc (Shirley and Chiu 1997).
    const auto wrap = [](double x) { return 2.0 * (x - std::floor(x)) - 1.0; };
    const double a = wrap(0.5 + 0.5385972572236101 * pass), b = wrap(0.5 + 0.6287067210378087 * pass);
    if (a == 0.0 && b == 0.0) return glm::dvec2(0.0);
    const bool wide = std::abs(a) > std::abs(b);
    const double radius = wide ? a : b;
    const double angle = 0.25 * std::numbers::pi * (wide ? b / a : 2.0 - a / b);
    return radius * glm::dvec2(std::cos(angle), std::sin(angle));
}

double circle_of_confusion(const Lens& lens, double depth)
{
    return lens.diameter * std::abs(1.0 / lens.focus - 1.0 / depth);
}

}  // namespace rcs
