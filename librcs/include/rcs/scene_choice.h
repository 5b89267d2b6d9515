#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/log.h"
#include "rcs/motion.h"
#include "rcs/scene.h"

namespace rcs {

/// What comes from outside the scene. Without a constant and without an image: what the scene itself says.
struct EnvironmentChoice {
    std::optional<glm::vec3> radiance;  ///< the same from every direction [W m^-2 sr^-1], >= 0; wins over `image`
    std::string image;                  ///< latitude-longitude image, a file
    double rotation_degrees = 0.0;      ///< turns the sky about the vertical, counter-clockwise seen from above
};

/// What is rendered: a scene in one pose, under one sky.
struct SceneChoice {
    std::string source;             ///< as load_scene() takes it
    std::optional<double> time;     ///< as LoadOptions::time [s]
    EnvironmentChoice environment;  ///< what comes from outside of it
    std::string asset_root;         ///< folder beneath which the file's buffers and images may lie; "": its own
    std::string animation = {};     ///< as LoadOptions::animation
};

/// scene_files() of a file with that asset root: names may then begin with "../".
RCS_API std::vector<std::string> scene_files(const SceneChoice& choice);

/// From where it is seen.
struct CameraChoice {
    std::string name;                      ///< as find_camera() takes it
    std::optional<Camera> given;           ///< instead of one of the scene's, in the space of the scene's file
    std::optional<glm::dvec2> lens_shift;  ///< instead of the camera's own [heights of the picture]
};

/// Another time or camera: what the layer `motion` tells of.
struct MotionChoice {
    std::optional<double> time;          ///< as LoadOptions::time [s]; none: the picture's
    std::optional<CameraChoice> camera;  ///< none: the picture's
};

/// A constant or an image takes the place of all that the scene says about its sky; the rotation adds to what is there.
/// @throws Error bad_file that names the image
RCS_API void set_environment(Scene& scene, const EnvironmentChoice& choice, const LogFunction& log = {});

/// Whether what load_scene() makes of it differs from one time to another: it has animations.
/// @throws Error as load_scene() does, where the file is none
RCS_API bool is_animated(const std::string& source);

/// One of the animations in a file.
struct AnimationInfo {
    std::string name;      ///< "" where the file gives none
    double seconds = 0.0;  ///< time of its last keyframe; 0 where the file does not say it
};
/// Those of a scene, in the file's order. @throws Error as load_scene() does, where the file is none
RCS_API std::vector<AnimationInfo> list_animations(const std::string& source);

/// load_scene() and set_environment(). @param like  as LoadOptions::like: the scene at another time, say
RCS_API Scene load_scene(const SceneChoice& choice, const LogFunction& log = {}, const Scene* like = nullptr);

/// @throws Error not_found; the message lists the cameras there are
RCS_API Camera choose_camera(const Scene& scene, const CameraChoice& choice);

/// Loads the scene once more if the time is another; without its textures, which tell nothing of where points are.
/// @param scene  of the picture, loaded as `picture` says, and seen as `camera` says
RCS_API MotionFrom load_motion(const MotionChoice& choice, const Scene& scene, const SceneChoice& picture,
                               const CameraChoice& camera);

}  // namespace rcs
