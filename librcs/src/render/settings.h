#pragma once

#include <cstdint>

#include "direct/direct.h"
#include "glossy/traced_lobes.h"
#include "rcs/direct_light.h"
#include "rcs/effect_plan.h"
#include "rcs/light_cache.h"
#include "rcs/records.h"
#include "rcs/render_options.h"
#include "rcs/splat.h"

namespace rcs {

/// What the plan made of the options: const from there on.
struct Settings {
    EffectSet effects;  ///< that are simulated
    Quality quality;
    std::uint64_t seed = 1;
    int passes = 1;  ///< of the picture, at most
    bool shares_samples = false;
    float texture_scale = 1.0f;  ///< width of the texture filter [px]
    bool has_lamps = false;      ///< that pixels sample
    LightCacheSettings light_cache;
    DirectSettings direct;  ///< of the first pass
    LobeSettings lobes;     ///< of one round of tracing in it
    RecordSettings records;
    SplatSettings splat;

    bool needs(Effect effect) const { return effects.has(effect); }
};

/// The records' settings as far as the options say them.
RecordSettings record_settings(const RenderOptions& options);

/// @param asked  valid   @param scene  that the plan was made for
Settings make_settings(const RenderOptions& asked, const EffectPlan& plan, const Scene& scene);

}  // namespace rcs
