#pragma once

#include <memory>

#include "rcs/camera.h"
#include "rcs/scene.h"

namespace rcs {

/// Where the points of a picture were at another time or for another camera: what the layer `motion` is told by.
struct MotionFrom {
    std::shared_ptr<const Scene> pose;  ///< the same file, loaded at the other time; null: the scene of the picture
    Camera camera;                      ///< that looked at it then, in the pose's scene space
};

}  // namespace rcs
