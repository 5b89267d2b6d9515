#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "rcs/gbuffer.h"
#include "rcs/image.h"
#include "rcs/splat.h"

namespace rcs {

/// Light at the visible points of one pass; what is empty does not take part.
struct PassLight {
    std::vector<glm::vec3> direct;         ///< irradiance of lamps [W m^-2]
    std::vector<glm::vec3> direct_glossy;  ///< lamps' light that specular lobes reflect [W m^-2 sr^-1]
    SplatBuffer indirect;                  ///< the records' sums; width 0: none
    std::vector<glm::vec3> traced;         ///< indirect light of lobes that are ray traced [W m^-2 sr^-1]
};

/// Adds one pass to the sums of a picture: every pass counts the same. Layers as LayeredImage names them.
/// @return visible pixels that no record reaches
std::size_t accumulate_pass(const GBuffer& gbuffer, const View& view, const Shading& shading, const PassLight& light,
                            LayeredImage& sums);

/// Divides the sums by the number of passes and adds up beauty.
void finish_passes(int passes, LayeredImage& sums);

}  // namespace rcs
