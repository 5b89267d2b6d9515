#pragma once

#include "denoise/oidn.h"
#include "gbuffer/checked_pixels.h"
#include "rcs/denoise_stats.h"
#include "rcs/image.h"

namespace rcs {

/// Filters what pixels of a finished picture have sampled by themselves (kSampledLayer, which goes), as far as it
/// helps: how much filtered light the picture takes, and what its error is then, the checked pixels' independent
/// samples say.
/// @param checked  pixels whose light was sampled again
DenoiseStats denoise(const Oidn& oidn, const CheckedPixels& checked, LayeredImage& image);

}  // namespace rcs
