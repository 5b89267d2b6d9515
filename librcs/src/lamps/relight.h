#pragma once

#include "rcs/ray_scene.h"

namespace rcs {

/// Takes over lamps without size and the sky of the scene as they are now, where all else is as it was built for.
void relight(RayScene& rays);

}  // namespace rcs
