#pragma once

#include <OpenColorIO/OpenColorIO.h>

namespace rcs {

/// The colour space of librcs's own images, by its name in the built-in configuration.
inline constexpr const char* kLinearRec709 = "Linear Rec.709 (sRGB)";

/// The configuration for those who bring none, made of OpenColorIO's own transforms: displays sRGB and
/// Rec.1886, each with the views "ACES 1.0 SDR" (the default) and "Un-tone-mapped".
OCIO_NAMESPACE::ConstConfigRcPtr builtin_config();

}  // namespace rcs
