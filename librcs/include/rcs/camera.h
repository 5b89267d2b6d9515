#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "rcs/api.h"

namespace rcs {

/// How a camera projects.
enum class Projection { perspective, orthographic };

/// A pinhole or parallel camera that looks along -Z of its view space, +Y up, as in glTF.
struct Camera {
    std::string name;                                 ///< by which it is chosen; may be empty
    Projection projection = Projection::perspective;  ///< which of yfov and ymag counts
    glm::dmat4 world_from_view{1.0};                  ///< rigid: no scale, no shear
    double yfov = 0.8;                                ///< vertical field of view [rad], in (0, pi); perspective
    double ymag = 1.0;                                ///< half the height of the view [m], > 0; orthographic
    /// Where the picture's middle lies beside the optical axis, to the right and up [heights of the picture], each in
    /// [-10, 10]: a lens shift keeps uprights parallel where turning the camera would not.
    glm::dvec2 lens_shift{0.0};

    /// Whether they show the same, and are called the same.
    bool operator==(const Camera&) const = default;
};
/// Each component of Camera::lens_shift is at most so far from 0.
inline constexpr double kMostLensShift = 10.0;

/// The opening of a lens: what lies nearer or farther than it is focused on is blurred.
struct Lens {
    double diameter = 0.0;  ///< of the opening, a disc across the camera's axis about its place [m], > 0
    double focus = 1.0;     ///< distance along the axis of the plane that is sharp, and framed as by a pinhole [m], > 0
};

/// Height of the film, 36 x 24 mm, that a lens with an f-number stands before [m].
inline constexpr double kFilmHeight = 0.024;

/// The lens whose focal length gives a perspective camera its field of view on that film, and whose opening is that
/// length over the f-number. The field of view stays what it is, wherever the lens is focused.
RCS_API Lens lens_of(const Camera& camera, double f_stop, double focus);

/// One image of a camera: its size, and where inside each pixel the single sample lies.
struct View {
    Camera camera;                      ///< that looks
    int width = 0;                      ///< [px]
    int height = 0;                     ///< [px]
    glm::dvec2 pixel_offset{0.5, 0.5};  ///< in [0, 1)^2; (0.5, 0.5) is the pixel's centre
    glm::ivec2 corner{0};               ///< of an image that is part of a picture: where it begins there [px]
    glm::ivec2 whole{0};  ///< size of that picture, which the camera frames [px]; 0: the image is all of it

    /// Whether they are the same image of the same camera.
    bool operator==(const View&) const = default;
};
/// Size of the picture that a view is, or is part of [px].
inline glm::ivec2 whole_size(const View& view)
{
    return view.whole == glm::ivec2(0) ? glm::ivec2(view.width, view.height) : view.whole;
}

/// Number of a pixel in the whole picture, which its random numbers go by.
inline std::uint64_t pixel_number(const View& view, std::size_t i)
{
    if (view.whole == glm::ivec2(0)) return i;
    const auto width = static_cast<std::size_t>(view.width);
    const auto number = [](int n) { return static_cast<std::uint64_t>(n); };
    return (number(view.corner.y) + i / width) * number(view.whole.x) + number(view.corner.x) + i % width;
}

/// How a view's image lies across its optical axis, x to the right and y down; on the plane at distance 1 in front of
/// the eye, or anywhere before an orthographic camera. Pixels are square.
struct ImagePlane {
    double pixel = 0.0;    ///< side of a pixel [m]
    glm::dvec2 axis{0.0};  ///< image position where the axis goes through [px]
};
/// That of a view.
RCS_API ImagePlane image_plane(const View& view);

/// Where a point shows in the image [px], as camera_ray() counts; none if it lies behind a perspective camera.
/// @param relative  to camera_position() [m]
RCS_API std::optional<glm::dvec2> image_position(const View& view, glm::dvec3 relative);

/// The ray through image position (x, y) [px], (0, 0) the top left corner of the image, with its
/// change per pixel (Igehy 1999, "Tracing ray differentials").
struct CameraRay {
    glm::dvec3 origin;        ///< scene space [m]
    glm::dvec3 direction;     ///< perspective: view-space z component is -1, so not a unit vector
    glm::dvec3 origin_dx;     ///< change of the origin for a pixel to the right [m]
    glm::dvec3 origin_dy;     ///< ... and for one down [m]
    glm::dvec3 direction_dx;  ///< change of the direction for a pixel to the right
    glm::dvec3 direction_dy;  ///< ... and for one down
};
/// That of a view. @param x,y  image position [px], (0, 0) the top left corner
RCS_API CameraRay camera_ray(const View& view, double x, double y);

/// Where the camera stands, in scene space; for an orthographic view the centre of its image plane.
RCS_API glm::dvec3 camera_position(const Camera& camera);

/// A camera at `eye` that looks at `target`. @param yfov  vertical field of view [rad]
RCS_API Camera look_at_camera(std::string name, glm::dvec3 eye, glm::dvec3 target, double yfov,
                              glm::dvec3 up = {0.0, 1.0, 0.0});

}  // namespace rcs
