#pragma once

#include <cstdint>
#include <vector>

#include "direct/direct.h"
#include "gbuffer/past_view.h"
#include "glossy/traced_lobes.h"
#include "rcs/effect_plan.h"
#include "records/watch.h"

namespace rcs {

/// What says whether two views' samples are of the same light, and alike.
struct SampledWith {
    std::uint32_t scene_number = 0;
    std::uint64_t gathered_lamps = 0;
    EffectSet effects = {};
    int area_samples = 0, penumbra_samples = 0, lamp_picks = 0;  ///< as of DirectSettings
    int lobe_rays = 0, bounces = 0;                              ///< as of LobeSettings

    bool operator==(const SampledWith&) const = default;
};

/// What the pixels of one pass of a view got by samples of their own: the same pass of the next view goes on from
/// there.
struct KeptSamples {
    SampledWith with;
    std::uint64_t seed = 1;
    std::uint64_t views = 0;  ///< that have gone on so before
    PastPoints points;
    std::vector<Bounds> moved = {};  ///< what has moved since, as it was and as it is
    DirectLightResult direct;        ///< empty: lamps have no size
    TracedLight traced;              ///< empty: no lobes are traced
    /// Luminance of what both send to the camera, per pixel, and a little: by what part of that they are off counts.
    std::vector<float> all;
    float little_direct = 0.0f;  ///< a hundredth of what lamps send to the camera from a pixel in the mean
};

/// Takes the samples of a view to another scene: what is reflected along lobes goes, and all of it where light may have
/// changed everywhere.
void follow_change(std::vector<KeptSamples>& samples, const SceneChange& change);

}  // namespace rcs
