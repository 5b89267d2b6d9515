#pragma once

#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/scene_choice.h"

namespace rcs {

/// Where a camera is at a time. World space, that of the scene's file.
struct CameraKey {
    double time = 0.0;              ///< [s]
    std::string camera = {};        ///< one of the scene's, in place of all below
    glm::dvec3 eye{0.0, 0.0, 1.0};  ///< [m]
    glm::dvec3 target{0.0};         ///< in the middle of the picture [m]
    glm::dvec3 up{0.0, 1.0, 0.0};   ///< upwards in the picture, any length but 0
    double yfov = 0.8;              ///< vertical field of view [rad], in (0, pi)
    bool cut = false;               ///< nothing leads here from the key before
};

/// A camera that moves. Between keys each of eye, target, up and field of view follows a cubic Hermite spline whose
/// tangent at a key is the slope from the key before to the one after (Catmull and Rom 1974, for keys at any times), at
/// the ends of a stretch that to the only neighbour; the field of view stays between those of its two keys. A stretch
/// ends before a key that cuts, and at one that names a camera; until the next one begins its last key holds, as the
/// first and the last of all do before and after.
struct CameraPath {
    std::vector<CameraKey> keys;  ///< at least one, by ascending time
};

/// @throws Error bad_argument: the key, its field, value and range
RCS_API void validate(const CameraPath& path);

/// Reads a path from JSON, as docs/batches.md describes it.
/// @throws Error not_found; bad_file: file, key, value and range
RCS_API CameraPath load_camera_path(const std::string& file);

/// What is looked through at a time [s]. @throws Error bad_argument: on its way the eye meets its target
RCS_API CameraChoice camera_at(const CameraPath& path, double time);

}  // namespace rcs
