#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/splat.h"

namespace rcs {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Interval {
    double low, high;  ///< nothing if low > high
};
constexpr Interval kNothing{kInfinity, -kInfinity};
constexpr Interval kEverything{-kInfinity, kInfinity};

/// The slopes x / depth of the points of a disc with depth > 0. Seen from the eye along the other image
/// axis a sphere is such a disc, so each image axis is a problem of its own, solved exactly by the two
/// tangents from the eye: the directions to the centre, turned by the disc's angular radius both ways.
Interval perspective_slopes(double x, double depth, double radius)
{
    if (depth + radius <= 0.0) return kNothing;
    const double distance2 = x * x + depth * depth;
    // Rounded down by more than the four roundings in it, so that the tangents never lie too far inside.
    const double tangent2 = distance2 - radius * radius - 8.0 * 0x1p-53 * distance2;
    if (!(tangent2 > 0.0)) return kEverything;  // the eye is inside, or the numbers are not finite
    const double tangent = std::sqrt(tangent2);
    const double low_depth = depth * tangent + x * radius;
    const double high_depth = depth * tangent - x * radius;
    // A tangent that points behind the eye plane leaves that side of the image without an end.
    return {low_depth > 0.0 ? (x * tangent - depth * radius) / low_depth : -kInfinity,
            high_depth > 0.0 ? (x * tangent + depth * radius) / high_depth : kInfinity};
}

/// The x of the points of a disc with depth >= 0.
Interval parallel_extent(double x, double depth, double radius)
{
    if (depth + radius < 0.0) return kNothing;
    const double reach = depth >= 0.0 ? radius : std::sqrt(std::max(0.0, radius * radius - depth * depth));
    return {x - reach, x + reach};
}

/// The indices i in [0, size) whose sample position i + offset lies in the interval [px].
void covered_pixels(Interval pixels, double offset, int size, int& begin, int& end)
{
    // Far above what double precision loses between here and there, far below a pixel.
    constexpr double kSlack = 1e-6;
    const double first = std::ceil(pixels.low - offset - kSlack);
    const double last = std::floor(pixels.high - offset + kSlack);
    // The comparisons are false for a NaN, which thereby gives the whole image.
    begin = first > 0.0 ? static_cast<int>(std::min(first, static_cast<double>(size))) : 0;
    end = last < size - 1.0 ? static_cast<int>(std::max(last + 1.0, 0.0)) : size;
}

}  // namespace

PixelBounds sphere_bounds(const View& view, glm::dvec3 centre, double radius)
{
    const Camera& camera = view.camera;
    // A rigid transform is undone by its transpose; the image's y axis points down.
    const double x = glm::dot(glm::dvec3(camera.world_from_view[0]), centre);
    const double y = -glm::dot(glm::dvec3(camera.world_from_view[1]), centre);
    const double depth = -glm::dot(glm::dvec3(camera.world_from_view[2]), centre);
    const bool perspective = camera.projection == Projection::perspective;
    const auto extent = perspective ? perspective_slopes : parallel_extent;
    const ImagePlane plane = image_plane(view);
    const auto to_pixels = [&plane](Interval interval, double axis) {
        return Interval{interval.low / plane.pixel + axis, interval.high / plane.pixel + axis};
    };
    PixelBounds bounds;
    covered_pixels(to_pixels(extent(x, depth, radius), plane.axis.x), view.pixel_offset.x, view.width, bounds.x0,
                   bounds.x1);
    covered_pixels(to_pixels(extent(y, depth, radius), plane.axis.y), view.pixel_offset.y, view.height, bounds.y0,
                   bounds.y1);
    return bounds.empty() ? PixelBounds{} : bounds;
}

}  // namespace rcs
