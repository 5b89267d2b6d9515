#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/camera.h"
#include "rcs/ray_scene.h"

namespace rcs {

struct RenderOptions;

/// What may have to be simulated for a picture.
enum class Effect : std::uint8_t {
    emission,           ///< what shines or shows sky to the camera
    punctual_light,     ///< lamps without size, at pixels and at gather hits
    area_light,         ///< emissive triangles, likewise
    environment,        ///< light of the sky on surfaces
    environment_peaks,  ///< its peaks, sampled like a lamp
    highlights,         ///< lamps in specular lobes
    indirect_diffuse,   ///< irradiance records
    more_bounces,       ///< a light cache: light reflected more than once
    glossy_records,     ///< wide lobes: records keep radiance
    traced_lobes,       ///< narrow lobes, coats, rough transmission: rays per pixel
    transmission,       ///< rays of light go through thin walls
    alpha_mask,         ///< rays ask masked surfaces
    alpha_blend,        ///< rays ask blended surfaces
    peeling,            ///< layers of surfaces behind those that the camera sees through
    normal_maps,
    hit_textures,   ///< base colour textures where rays hit; else their mean colours
    anti_aliasing,  ///< more than one pass
    deformation,    ///< skins and morph targets
    instancing,     ///< meshes used more than once are shared by rays
    motion,         ///< reuse from frame to frame
    auto_exposure,
    error_estimate,
    layer_emission,
    layer_direct,
    layer_indirect,
    layer_indirect_error,
    layer_irradiance,
    layer_albedo,
    layer_normal,
    layer_depth,
    layer_records,
    count
};
inline constexpr std::size_t kEffects = static_cast<std::size_t>(Effect::count);

/// As the command line names it: "traced-lobes".
std::string_view name_of(Effect effect);
/// @throws Error not_found; lists those there are
Effect find_effect(std::string_view name);

class EffectSet {
public:
    EffectSet() = default;
    static EffectSet all();

    bool has(Effect effect) const { return (bits_ >> static_cast<unsigned>(effect) & 1u) != 0u; }
    void set(Effect effect, bool on = true)
    {
        const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(effect);
        bits_ = on ? bits_ | bit : bits_ & ~bit;
    }
    std::uint64_t bits() const { return bits_; }  ///< by the numbers of Effect
    bool operator==(const EffectSet&) const = default;

private:
    std::uint64_t bits_ = 0;
};

/// What the user says about effects; else the plan decides.
struct EffectChoice {
    EffectSet with;     ///< simulated, called for or not
    EffectSet without;  ///< not simulated; wins over `with`
};
/// "auto", "all" or names, separated by commas: those and no others.
/// @throws Error not_found: a name; unsupported: an effect that this build cannot simulate
EffectChoice parse_effects(std::string_view text);

/// One effect's decision.
struct PlannedEffect {
    enum class Basis {
        exact,     ///< follows from scene, view and options: `share` says all
        bound,     ///< `share` is the most it can be
        measured,  ///< by a pilot; `low` and `high` hold it with 95 % confidence
    };

    Effect effect{};
    bool needed = false;        ///< is simulated
    bool available = true;      ///< false: this build cannot
    bool chosen = false;        ///< the user said so, and the plan would not have
    bool has_material = false;  ///< the scene has what the effect is made of, wherever it lies
    std::string reason;         ///< in words, with the number behind it
    Basis basis = Basis::exact;
    double share = 0.0, low = 0.0, high = 0.0;  ///< what it contributes, as part of `of`
    std::string of;                             ///< "pixels", "the first bounce's power", ...
    double loss = 0.0;   ///< not needed, or needed in part: the most that leaving it out may lose, as part of `of`; 0:
                         ///< nothing is lost
    std::string cost;    ///< of simulating it, in words
    double rays = 0.0;   ///< about so many, for the whole picture
    double bytes = 0.0;  ///< about so much memory beyond a picture without it
};

/// What a view of a scene calls for. Where two effects differ only by name, the more specific one carries the cost.
struct EffectPlan {
    std::vector<PlannedEffect> effects;  ///< one for each Effect, in order
    int bounces = 0;                     ///< of indirect light, at most those of the options
    int passes = 1;                      ///< samples a pixel
    bool shares_samples = false;   ///< samples after the first share its light where the picture is smooth and they see
                                   ///< the same triangle: anti-aliasing only where it shows
    std::uint64_t pilot_rays = 0;  ///< that planning took

    const PlannedEffect& operator[](Effect effect) const { return effects[static_cast<std::size_t>(effect)]; }
    bool needs(Effect effect) const { return (*this)[effect].needed; }
    EffectSet set() const;
};

/// Decides from what the view needs: which surfaces the camera may see (bounds against the view's frustum; those inside
/// that matter are looked for with the very samples of the picture, up to a number of rays: found, ruled out or, where
/// the rays run out, taken for visible) and what light can reach. Nothing is drawn. The same for any number of threads.
EffectPlan plan_effects(const RayScene& rays, const Camera& camera, const RenderOptions& options);

}  // namespace rcs
