#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/past_view.h"
#include "gbuffer/shading.h"
#include "rcs/camera.h"
#include "rcs/direct_light.h"
#include "rcs/gbuffer.h"
#include "rcs/scene.h"

namespace rcs {

/// Which lamps a point finds free and which hidden, in part or wholly, by the shadow rays that it has shot; of many
/// lamps several share a bit.
struct LampSight {
    std::uint64_t free = 0, hidden = 0;

    std::uint64_t seen() const { return free | hidden; }
    std::uint64_t mixed() const { return free & hidden; }
};

/// What a visible point gets of lamps, by samples of its own.
struct DirectAgain {
    std::uint32_t pixel = GBuffer::kNone;
    glm::vec3 irradiance[2] = {}, glossy[2] = {};  ///< independent of each other and of the pixel's own
};

/// Light of the lamps and of the sky's peaks at every visible point.
struct DirectLightResult {
    std::vector<glm::vec3> irradiance;  ///< for diffuse reflection [W m^-2]
    std::vector<glm::vec3> glossy;      ///< radiance towards the viewer by specular lobe and coat; empty without BSDFs
    std::vector<std::uint8_t> in_part;  ///< 1 where neighbours see a lamp with area or a peak in part, or lamps are
                                        ///< drawn: an average over few rays; empty where all lamps are without size
    /// Standard errors of luminance, estimated; empty where there are none or DirectSettings::error does not ask.
    std::vector<float> irradiance_error, glossy_error;
    std::vector<DirectAgain> again;  ///< of the squares of CheckedPixels; empty where nobody asked, or all is exact
    std::vector<LampSight> sight;    ///< of the pixels' first look; empty where nobody looks twice
    /// What each pixel found by itself, before it was put together with what those around found; empty where it is not.
    struct Apart {
        std::vector<glm::vec3> irradiance;
        std::vector<float> error;
    } apart;
};

/// What an earlier view of the same scene had of the same lamps.
struct PastDirect {
    const PastPlaces& places;
    const DirectLightResult& light;
    const std::vector<float>& all;  ///< per pixel, about what there is to see of all that is sampled (KeptSamples)
    float little;                   ///< of the light of lamps: as good as none [W m^-2 sr^-1]
    std::span<const Bounds> moved;  ///< what has moved since, as it was and as it is
    std::uint64_t turn;             ///< of the view: whose pixels are sampled anew
    std::uint64_t number;           ///< of the pass: what is drawn
    bool is_still = false;          ///< the view is this one: what has not changed keeps its samples
};

/// @param view  of `gbuffer`: says where each point is seen from
/// @param shading  may be empty: then all is diffuse   @param shadow_rays  is increased by the number of rays shot
/// @param past  spares most pixels whose light it knows their samples; null: each has samples of its own
DirectLightResult direct_light(const RayScene& rays, const GBuffer& gbuffer, const View& view, const Shading& shading,
                               const DirectSettings& options, ThreadPool& pool, std::uint64_t& shadow_rays,
                               const PastDirect* past = nullptr);

/// Whether lamps have a size, so that it takes an average over rays to know their light.
bool averages_direct_light(const RayScene& rays, const DirectSettings& options);

/// Wall time that direct_light() would take without a second look at penumbras [s], as far as some of the pixels tell.
double try_direct_light(const RayScene& rays, const GBuffer& gbuffer, const View& view, const Shading& shading,
                        const DirectSettings& options, ThreadPool& pool);

}  // namespace rcs
