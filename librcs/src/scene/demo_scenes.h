#pragma once

#include <optional>
#include <string>

#include "rcs/scene.h"

namespace rcs {

/// @param name  one of demo_scene_names()   @throws Error not_found, which lists them
/// @param time  of its animation [s], if it has one; none: its rest pose
Scene make_demo_scene(const std::string& name, std::optional<double> time = {});
/// @throws Error not_found, which lists them
bool is_animated_demo(const std::string& name);
inline constexpr double kDemoSeconds = 2.0;  ///< how long those that move do

Scene make_cornell();
Scene make_atrium();
/// The same in 2 s of motion [s], held before and after: the camera "walk" goes along the north arcade, where a ball
/// rolls by the wall; from 0.5 to 1.75 s a gate to the court opens, and at 1 s a lamp is switched on.
Scene make_atrium_at(double time);
/// Metal and plastic spheres, roughness 0 to 1 in steps of 0.1, in a room with one window.
Scene make_spheres();
/// A room lit through a door that stands ajar, from a lamp behind it.
Scene make_ajar();
/// A room behind a blind, lit by a panel outside as large as the sky.
Scene make_blinds();

}  // namespace rcs
