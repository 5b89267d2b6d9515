#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "rcs/camera.h"

namespace rcs {

/// Where points show in one view, as image_position() gives it: what they share is found once.
class ImageProjection {
public:
    explicit ImageProjection(const View& view) : ImageProjection(view, view.camera) {}
    /// In the image of `view`, were it that camera's.
    ImageProjection(const View& view, const Camera& camera);

    std::optional<glm::dvec2> position(glm::dvec3 relative) const
    {
        const glm::dvec3 p = turn_ * relative;
        if (perspective_ && !(p.z < 0.0)) return std::nullopt;
        const double pixel = perspective_ ? plane_.pixel * -p.z : plane_.pixel;
        return plane_.axis + glm::dvec2(p.x, -p.y) / pixel;
    }
    bool is_perspective() const { return perspective_; }

private:
    glm::dmat3 turn_;
    ImagePlane plane_;
    bool perspective_;
};

/// The rays of one view, as camera_ray() gives them: what they share is found once.
class CameraRays {
public:
    explicit CameraRays(const View& view);

    /// @param x,y  image position [px], (0, 0) the top left corner
    CameraRay through(double x, double y) const
    {
        // In the whole picture's pixels, so that a part of it has the same rays to the bit.
        const glm::dvec2 at = corner_ + glm::dvec2(x, y) - axis_;
        const glm::dvec3 offset = dx_ * at.x + dy_ * at.y;
        const glm::dvec3 none(0.0);
        if (perspective_) return {eye_, offset - back_, none, none, dx_, dy_};
        return {eye_ + offset, -back_, dx_, dy_, none, none};
    }
    bool is_perspective() const { return perspective_; }
    /// Through the sample of a pixel.
    CameraRay of_pixel(int x, int y) const { return through(x + sample_.x, y + sample_.y); }

private:
    glm::dvec3 eye_, back_, dx_, dy_;  // of a pixel
    glm::dvec2 corner_, axis_, sample_;
    bool perspective_;
};

}  // namespace rcs
