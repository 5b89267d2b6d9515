#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/gbuffer.h"
#include "rcs/motion.h"
#include "scene/camera_rays.h"

namespace rcs {

/// How points of a picture move on the image: [px], x to the right, y up, from where the point was to where it is.
/// Points are followed by their place on their triangle, so instances, skins and morph targets move them.
class Motion {
public:
    /// @param scene  of the picture; must outlive this
    Motion(const Scene& scene, const MotionFrom& from);

    /// Tells of motion as this camera saw it, in the place of views through points of its lens.
    void seen_by_pinhole(const Camera& camera) { pinhole_ = camera; }

    /// A view, and the image that it is compared with.
    struct Images {
        CameraRays rays;
        ImageProjection now, then;
        glm::dvec3 eye_now, eye_then;
    };
    Images images_of(const View& view) const;

    /// Of the surface that a pixel's sample sees; none where it was behind the camera, or is not in the other pose.
    std::optional<glm::dvec2> of_surface(const GBuffer& gbuffer, const Images& images, std::size_t pixel) const;
    /// Of what is infinitely far away. @param image_point  [px], as camera_ray() counts
    /// @return none if one of the cameras is orthographic, or it was behind the other
    static std::optional<glm::dvec2> of_sky(const Images& images, glm::dvec2 image_point);

private:
    const Scene& other() const { return from_.pose ? *from_.pose : here_; }

    const Scene& here_;
    MotionFrom from_;
    std::optional<Camera> pinhole_;
    std::vector<int> instance_there_;  ///< by instance of the picture; -1: none is the same
};

}  // namespace rcs
