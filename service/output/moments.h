#pragma once

#include <functional>

#include "rcs/render.h"
#include "rcs/scene_choice.h"

namespace rcs::service {

/// When a picture is exposed.
struct Exposed {
    double open = 0.0;     ///< how long the shutter is [s], around
    double picture = 0.0;  ///< the picture's own time [s]

    /// When a part of that has passed [s].
    double at(double part) const { return picture + (part - 0.5) * open; }
};

/// What is seen while the shutter is open.
/// @param scene    whose time does not count
/// @param camera   what is looked through at a time [s]
/// @param session  shows the scene at any time; it must outlive what is returned
MomentFunction moments_of(const SceneChoice& scene, const std::function<CameraChoice(double)>& camera,
                          const Session& session, Exposed exposed);

}  // namespace rcs::service
