#pragma once

#include <string>

#include "rcs/camera.h"
#include "rcs/camera_path.h"
#include "rcs/scene_choice.h"
#include "rcs/v1/job.pb.h"

/// What is looked at, and from where: between the library's words and the wire's.
namespace rcs::service {

v1::LensShift to_message(const glm::dvec2& lens_shift);
/// @throws ServiceError bad_argument
glm::dvec2 from_message(const v1::LensShift& message);

v1::Camera to_message(const Camera& camera);
/// @throws rcs::Error bad_argument
Camera from_message(const v1::Camera& message);

/// @param label  for whoever looks   @return without its image, which is a file to upload
v1::Environment to_message(const EnvironmentChoice& choice, const std::string& label);
/// @param image_file  where its image lies, if it has one
EnvironmentChoice from_message(const v1::Environment& message, const std::string& image_file);

v1::CameraPath to_message(const CameraPath& path);
/// @throws rcs::Error bad_argument
CameraPath from_message(const v1::CameraPath& message);

/// What a frame is looked at through. @param path  Job.camera_path; without keys: none
/// @param time  of the picture, or of a moment of it [s]
/// @throws rcs::Error bad_argument
CameraChoice camera_choice(const v1::Frame& frame, const v1::CameraPath& path, double time);
CameraChoice camera_choice(const v1::Frame& frame, const v1::CameraPath& path);

v1::Motion to_message(const MotionChoice& choice);
/// Of a frame's other camera: the lens shift of its own counts for it, too.
/// @throws rcs::Error bad_argument
MotionChoice motion_choice(const v1::Frame& frame);

}  // namespace rcs::service
