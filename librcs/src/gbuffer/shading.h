#pragma once

#include <vector>

#include "material/bsdf.h"

namespace rcs {

/// How the visible points of a G-buffer reflect, where that takes more than their albedo.
struct Shading {
    std::vector<Bsdf> bsdf;  ///< per pixel; empty if all surfaces are Lambertian
};

}  // namespace rcs
