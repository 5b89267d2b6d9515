#pragma once

#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "rcs/api.h"

namespace rcs {

enum class Projection { perspective, orthographic };

/// A pinhole or parallel camera that looks along -Z of its view space, +Y up, as in glTF.
struct Camera {
    std::string name;
    Projection projection = Projection::perspective;
    glm::dmat4 world_from_view{1.0};  ///< rigid: no scale, no shear
    double yfov = 0.8;                ///< vertical field of view [rad], in (0, pi); perspective
    double ymag = 1.0;                ///< half the height of the view [m], > 0; orthographic
    /// Where the picture's middle lies beside the optical axis, to the right and up [heights of the picture], each in
    /// [-10, 10]: a lens shift keeps uprights parallel where turning the camera would not.
    glm::dvec2 lens_shift{0.0};

    bool operator==(const Camera&) const = default;
};
inline constexpr double kMostLensShift = 10.0;

/// One image of a camera: its size, and where inside each pixel the single sample lies.
struct View {
    Camera camera;
    int width = 0;                      ///< [px]
    int height = 0;                     ///< [px]
    glm::dvec2 pixel_offset{0.5, 0.5};  ///< in [0, 1)^2; (0.5, 0.5) is the pixel's centre

    bool operator==(const View&) const = default;
};

/// How a view's image lies across its optical axis, x to the right and y down; on the plane at distance 1 in front of
/// the eye, or anywhere before an orthographic camera. Pixels are square.
struct ImagePlane {
    double pixel = 0.0;    ///< side of a pixel [m]
    glm::dvec2 axis{0.0};  ///< image position where the axis goes through [px]
};
RCS_API ImagePlane image_plane(const View& view);

/// Where a point shows in the image [px], as camera_ray() counts; none if it lies behind a perspective camera.
/// @param relative  to camera_position() [m]
RCS_API std::optional<glm::dvec2> image_position(const View& view, glm::dvec3 relative);

/// The ray through image position (x, y) [px], (0, 0) the top left corner of the image, with its
/// change per pixel (Igehy 1999, "Tracing ray differentials").
struct CameraRay {
    glm::dvec3 origin;
    glm::dvec3 direction;  ///< perspective: view-space z component is -1, so not a unit vector
    glm::dvec3 origin_dx, origin_dy;
    glm::dvec3 direction_dx, direction_dy;
};
RCS_API CameraRay camera_ray(const View& view, double x, double y);

/// Where the camera stands, in scene space; for an orthographic view the centre of its image plane.
RCS_API glm::dvec3 camera_position(const Camera& camera);

/// A camera at `eye` that looks at `target`. @param yfov  vertical field of view [rad]
RCS_API Camera look_at_camera(std::string name, glm::dvec3 eye, glm::dvec3 target, double yfov,
                              glm::dvec3 up = {0.0, 1.0, 0.0});

}  // namespace rcs
