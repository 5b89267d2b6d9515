#pragma once

#include <string>

#include "rcs/scene.h"

namespace rcs {

/// @param name  one of demo_scene_names()   @throws Error not_found, which lists them
Scene make_demo_scene(const std::string& name);

Scene make_cornell();
Scene make_atrium();
/// Metal and plastic spheres, roughness 0 to 1 in steps of 0.1, in a room with one window.
Scene make_spheres();
/// A room lit through a door that stands ajar, from a lamp behind it.
Scene make_ajar();
/// A room behind a blind, lit by a panel outside as large as the sky.
Scene make_blinds();

}  // namespace rcs
