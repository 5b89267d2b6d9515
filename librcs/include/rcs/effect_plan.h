#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/api.h"
#include "rcs/camera.h"
#include "rcs/effects.h"
#include "rcs/layers.h"
#include "rcs/ray_scene.h"

namespace rcs {

struct RenderOptions;

/// One effect's decision.
struct PlannedEffect {
    /// How its share is known.
    enum class Basis {
        exact,     ///< follows from scene, view and options: `share` says all
        bound,     ///< `share` is the most it can be
        measured,  ///< by a pilot; `low` and `high` hold it with 95 % confidence
    };

    Effect effect{};             ///< that is decided on
    bool needed = false;         ///< is simulated
    bool chosen = false;         ///< the user said so, and the plan would not have
    bool has_material = false;   ///< the scene has what the effect is made of, wherever it lies
    std::string reason;          ///< in words, with the number behind it
    Basis basis = Basis::exact;  ///< how its share is known
    double share = 0.0;          ///< what it contributes, as part of `of`
    double low = 0.0;            ///< the least that may be, where it is measured
    double high = 0.0;           ///< ... and the most
    std::string of;              ///< "pixels", "the first bounce's power", ...
    double loss = 0.0;   ///< not needed, or needed in part: the most that leaving it out may lose, as part of `of`; 0:
                         ///< nothing is lost
    std::string cost;    ///< of simulating it, in words
    double rays = 0.0;   ///< about so many, for the whole picture
    double bytes = 0.0;  ///< about so much memory beyond a picture without it
};

/// One layer's decision.
struct PlannedLayer {
    const LayerKind* layer = nullptr;  ///< that is decided on; never null
    bool kept = false;                 ///< by an output
    bool made = false;                 ///< kept, or beauty or the error estimate takes it in; else it costs nothing
    double bytes = 0.0;                ///< of memory, if it is made
};

/// What a view of a scene calls for. Where two effects differ only by name, the more specific one carries the cost.
struct EffectPlan {
    std::vector<PlannedEffect> effects;  ///< one for each Effect, in order
    std::vector<PlannedLayer> layers;    ///< one for each layer that a render can make, in the order of all_layers()
    int bounces = 0;                     ///< of indirect light, at most those of the options
    int passes = 1;                      ///< samples a pixel
    bool shares_samples = false;   ///< samples after the first share its light where the picture is smooth and they see
                                   ///< the same triangle: anti-aliasing only where it shows
    std::uint64_t pilot_rays = 0;  ///< that planning took

    /// An effect's decision.
    const PlannedEffect& operator[](Effect effect) const { return effects[static_cast<std::size_t>(effect)]; }
    /// Whether it is simulated.
    bool needs(Effect effect) const { return (*this)[effect].needed; }
    /// All that are simulated.
    EffectSet set() const;
};

/// Decides from what the view needs: which surfaces the camera may see (bounds against the view's frustum; those inside
/// that matter are looked for with the very samples of the picture, up to a number of rays: found, ruled out or, where
/// the rays run out, taken for visible) and what light can reach. Nothing is drawn. The same for any number of threads.
RCS_API EffectPlan plan_effects(const RayScene& rays, const Camera& camera, const RenderOptions& options);

}  // namespace rcs
