#include "rcs/camera.h"

#include <cmath>
#include <utility>

namespace rcs {

CameraRay camera_ray(const View& view, double x, double y)
{
    const Camera& camera = view.camera;
    const glm::dvec3 right(camera.world_from_view[0]);
    const glm::dvec3 up(camera.world_from_view[1]);
    const glm::dvec3 back(camera.world_from_view[2]);
    const glm::dvec3 eye(camera.world_from_view[3]);
    const double half_height =
        camera.projection == Projection::perspective ? std::tan(0.5 * camera.yfov) : camera.ymag;
    const double pixel = 2.0 * half_height / view.height;  // side of a pixel on the image plane
    const glm::dvec3 dx = right * pixel;
    const glm::dvec3 dy = up * -pixel;
    const glm::dvec3 offset = dx * (x - 0.5 * view.width) + dy * (y - 0.5 * view.height);
    const glm::dvec3 none(0.0);
    if (camera.projection == Projection::perspective)
        return {eye, offset - back, none, none, dx, dy};
    return {eye + offset, -back, dx, dy, none, none};
}

glm::dvec3 camera_position(const Camera& camera)
{
    return glm::dvec3(camera.world_from_view[3]);
}

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
