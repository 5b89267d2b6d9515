#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "rcs/effect_plan.h"
#include "rcs/motion.h"
#include "rcs/splat.h"

namespace rcs {

/// How close records lie and what they may be off by, in so many words.
struct QualitySettings {
    float error_tolerance = 0.2f;  ///< Ward's a, in (0, 1]; smaller is finer
    int rays = 128;                ///< hemisphere rays per record at first, in [16, 65536]; rounded to M x N strata
    float noise_target = 0.02f;    ///< standard error wanted at a pixel relative to its irradiance, > 0, where records
                                   ///< lie as far apart as they may; ones f times as close may have f^(2/3) times as
                                   ///< much. Where there is more, a record gets more, up to 16 times `rays`
};

/// Records are placed and rays chosen by the estimated error until that is small enough.
struct TargetError {
    double error = 0.05;  ///< mean relative error of indirect light (ErrorEstimate), in (0, 1]
};

/// The same for as long as there is time, with fewer passes where the time asks for it. What is rendered then depends
/// on the machine.
struct Budget {
    double seconds = 20.0;  ///< wall time of render() [s], in (0, 1e6]
};

using Quality = std::variant<QualitySettings, TargetError, Budget>;

/// What a user may ask of a picture, and nothing that follows from it.
struct RenderOptions {
    int width = 1000;   ///< [px], in [1, 16384]
    int height = 1000;  ///< [px], in [1, 16384]
    int aa = 4;         ///< jittered passes that share the records, in [1, 64]; 1 samples pixel centres
    int bounces = 1;    ///< bounces of indirect light, in [0, 64]; 8 is full interreflection but for very light rooms
    Quality quality = QualitySettings{};
    float min_reach = 15.0f;      ///< least R_k [px], in (0, max_reach]: a times it is the closest spacing
    float max_reach = 60.0f;      ///< largest R_k [px]: a times it is the widest spacing
    float gradient_limit = 3.0f;  ///< R_k is at most so many times E/|grad E|, > 0
    int area_samples = 16;  ///< shadow rays a pixel towards lamps with area, in [1, 1024]; each pass shoots its part
    int penumbra_samples = 64;  ///< the same where visibility is mixed, in [area_samples, 65536]
    int lamp_picks = 0;         ///< so many emissive triangles, picked by what they would send, stand for all
                                ///< (DirectSettings), in [0, 1024]; 0: none is left out
    int lobe_rays = 16;    ///< rays a pixel along lobes too narrow for records, shared between neighbours, in [1, 1024]
    float overlap = 3.0f;  ///< influence radius of the last splat, in spacing radii, in [1, 16]
    SplatMethod splat = SplatMethod::automatic;
    EffectChoice effects;  ///< what is simulated though the plan would not, and what is not though it would; alpha,
                           ///< transmission, normal maps and instancing are chosen in build_ray_scene()
    std::optional<std::vector<std::string>> layers;  ///< to make beside beauty (rcs/layers.h); none: the default ones
    std::optional<MotionFrom> motion;                ///< what the layer `motion` is told by
    bool dry_run = false;                            ///< stop after the forecast
    std::uint64_t seed = 1;                          ///< of every random stream
};

/// The settings asked for, to be changed; a goal gives way to the default settings.
QualitySettings& settings_of(RenderOptions& options);

/// The same to be read; those of a goal are the default ones.
QualitySettings settings_or_default(const RenderOptions& options);

/// Whether the quality is a target or a budget: then the estimated error steers what is done.
inline bool has_goal(const RenderOptions& options) { return !std::holds_alternative<QualitySettings>(options.quality); }
/// 0: none.
double target_error(const RenderOptions& options);
double budget_seconds(const RenderOptions& options);

/// @throws Error bad_argument: the field, its value and its range
void validate(const RenderOptions& options);

}  // namespace rcs
