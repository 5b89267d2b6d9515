#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "rcs/gbuffer.h"
#include "rcs/image.h"
#include "rcs/splat.h"

namespace rcs {

/// Adds one pass to the sums of a picture: every pass counts the same. Layers as LayeredImage names them.
/// @param direct  irradiance per pixel   @param indirect  the records' sums; empty (width 0) without indirect light
/// @return visible pixels that no record reaches
std::size_t accumulate_pass(const GBuffer& gbuffer, const View& view, const std::vector<glm::vec3>& direct,
                            const SplatBuffer& indirect, LayeredImage& sums);

/// Divides the sums by the number of passes and adds up beauty.
void finish_passes(int passes, LayeredImage& sums);

}  // namespace rcs
