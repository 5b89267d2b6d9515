#pragma once

#include <glm/glm.hpp>

namespace rcs {

/// Relative luminance of scene-linear Rec. 709 RGB (ITU-R BT.709).
inline float luminance(glm::vec3 rgb) { return 0.2126f * rgb.r + 0.7152f * rgb.g + 0.0722f * rgb.b; }

/// Of the three channels.
inline float largest(glm::vec3 rgb) { return glm::max(rgb.r, glm::max(rgb.g, rgb.b)); }

}  // namespace rcs
