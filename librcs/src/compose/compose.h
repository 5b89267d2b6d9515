#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "accuracy/error_estimate.h"
#include "compose/layer_sums.h"
#include "direct/direct.h"
#include "gbuffer/shading.h"
#include "glossy/traced_lobes.h"
#include "rcs/gbuffer.h"
#include "rcs/image.h"
#include "rcs/splat.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Light at the visible points of one pass; what is empty does not take part.
struct PassLight {
    const PictureLayers* layers = nullptr;  ///< that are made; never null
    DirectLightResult direct;
    SplatBuffer indirect;     ///< the records' sums; width 0: none
    SplatBuffer of_lamps;     ///< the part of them that gathered lamps send; width 0: there are none
    ErrorMap indirect_error;  ///< of both
    TracedLight traced;       ///< indirect light of lobes that are ray traced
};

/// Parts that are left of the standard errors of each kind of light.
struct ErrorParts {
    float lobes = 1.0f, direct = 1.0f, records = 1.0f;
};

/// What of a pass's light is shown: a PassLight's, or some of it from elsewhere.
struct ShownLight {
    const PictureLayers& layers;
    const DirectLightResult& direct;
    const SplatBuffer& indirect;
    const SplatBuffer& of_lamps;
    const ErrorMap& indirect_error;
    const TracedLight& traced;
    ErrorParts left = {};
};
inline ShownLight shown(const PassLight& light)
{
    return {*light.layers, light.direct, light.indirect, light.of_lamps, light.indirect_error, light.traced};
}

/// Adds one pass to the sums of a picture: every pass counts the same.
/// @param weight  per pixel, how much of its light passes the surfaces in front; empty: there are none, and the
///        surfaces are those whose albedo, normal and depth the picture keeps
/// @param known  pixels left to SharedSamples; may be null
/// @return visible pixels that no record reaches
std::size_t accumulate_pass(const GBuffer& gbuffer, const View& view, const Shading& shading, const ShownLight& light,
                            const std::vector<glm::vec3>& weight, const KnownSamples* known, LayeredImage& sums,
                            ThreadPool& pool);

/// Luminance that a visible point reflects of what records say, by all its lobes that they light [W m^-2 sr^-1].
float recorded_luminance(const GBuffer& gbuffer, const View& view, const Shading& shading, const SplatBuffer& sums,
                         std::size_t pixel);

/// Divides the sums by the number of passes and adds up beauty.
void finish_passes(int passes, LayeredImage& sums);

/// Drops what beauty and the estimate were made from if nobody wants it, and says what the file has to say of the rest.
void keep_layers(const PictureLayers& layers, LayeredImage& image);

}  // namespace rcs
