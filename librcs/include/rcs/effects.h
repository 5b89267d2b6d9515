#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "rcs/api.h"

namespace rcs {

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
    instancing,     ///< meshes used more than once are shared by rays
    error_estimate,
    count
};
/// How many effects there are.
inline constexpr std::size_t kEffects = static_cast<std::size_t>(Effect::count);

/// As the command line names it: "traced-lobes".
RCS_API std::string_view name_of(Effect effect);
/// @throws Error not_found; lists those there are
RCS_API Effect find_effect(std::string_view name);

/// Some of the effects.
class EffectSet {
public:
    constexpr EffectSet() = default;
    /// Those.
    constexpr EffectSet(std::initializer_list<Effect> effects)
    {
        for (const Effect effect : effects) set(effect);
    }
    /// All of them.
    RCS_API static EffectSet all();

    /// Whether this one is among them.
    constexpr bool has(Effect effect) const { return (bits_ >> static_cast<unsigned>(effect) & 1u) != 0u; }
    /// Whether any of those is.
    constexpr bool has_any(const EffectSet& of) const { return (bits_ & of.bits_) != 0u; }
    /// Whether there is none.
    constexpr bool empty() const { return bits_ == 0u; }
    /// Adds one, or takes it out.
    constexpr void set(Effect effect, bool on = true)
    {
        const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(effect);
        bits_ = on ? bits_ | bit : bits_ & ~bit;
    }
    constexpr std::uint64_t bits() const { return bits_; }  ///< by the numbers of Effect
    /// Whether both are the same effects.
    bool operator==(const EffectSet&) const = default;

private:
    std::uint64_t bits_ = 0;
};

/// What the user says about effects; else the plan decides.
struct EffectChoice {
    EffectSet with;     ///< simulated, called for or not
    EffectSet without;  ///< not simulated; shares no effect with `with`
};
/// "auto", "all" or names, separated by commas: those and no others.
/// @throws Error not_found: a name; lists those there are
RCS_API EffectChoice parse_effects(std::string_view text);

}  // namespace rcs
