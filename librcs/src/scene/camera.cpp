#include "rcs/camera.h"

#include <cmath>
#include <utility>

#include "scene/camera_rays.h"

namespace rcs {

namespace {

/// Of the whole picture.
ImagePlane whole_plane(const View& view, const Camera& camera)
{
    const double half_height = camera.projection == Projection::perspective ? std::tan(0.5 * camera.yfov) : camera.ymag;
    const glm::dvec2 size(whole_size(view));
    return {2.0 * half_height / size.y, 0.5 * size + glm::dvec2(-camera.lens_shift.x, camera.lens_shift.y) * size.y};
}

ImagePlane image_plane(const View& view, const Camera& camera)
{
    const ImagePlane whole = whole_plane(view, camera);
    return {whole.pixel, whole.axis - glm::dvec2(view.corner)};
}

}  // namespace

ImagePlane image_plane(const View& view) { return image_plane(view, view.camera); }

ImageProjection::ImageProjection(const View& view, const Camera& camera)
    : turn_(glm::transpose(glm::dmat3(camera.world_from_view))),  // undoes a rigid turn
      plane_(image_plane(view, camera)),
      perspective_(camera.projection == Projection::perspective)
{
}

std::optional<glm::dvec2> image_position(const View& view, glm::dvec3 relative)
{
    return ImageProjection(view).position(relative);
}

CameraRays::CameraRays(const View& view)
    : eye_(view.camera.world_from_view[3]),
      back_(view.camera.world_from_view[2]),
      corner_(view.corner),
      sample_(view.pixel_offset),
      perspective_(view.camera.projection == Projection::perspective)
{
    const ImagePlane plane = whole_plane(view, view.camera);
    axis_ = plane.axis;
    dx_ = glm::dvec3(view.camera.world_from_view[0]) * plane.pixel;
    dy_ = glm::dvec3(view.camera.world_from_view[1]) * -plane.pixel;
}

CameraRay camera_ray(const View& view, double x, double y) { return CameraRays(view).through(x, y); }

glm::dvec3 camera_position(const Camera& camera) { return glm::dvec3(camera.world_from_view[3]); }

Camera look_at_camera(std::string name, glm::dvec3 eye, glm::dvec3 target, double yfov, glm::dvec3 up)
{
    const glm::dvec3 back = glm::normalize(eye - target);
    const glm::dvec3 right = glm::normalize(glm::cross(up, back));
    Camera camera;
    camera.name = std::move(name);
    camera.yfov = yfov;
    camera.world_from_view[0] = glm::dvec4(right, 0.0);
    camera.world_from_view[1] = glm::dvec4(glm::cross(back, right), 0.0);
    camera.world_from_view[2] = glm::dvec4(back, 0.0);
    camera.world_from_view[3] = glm::dvec4(eye, 1.0);
    return camera;
}

}  // namespace rcs
