#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "material/lobe_kinds.h"
#include "material/scatter_lanes.h"

namespace rcs {

/// Some of a surface's lobes: bit i for its lobe i.
using LobeSet = std::uint32_t;
inline constexpr LobeSet kAllLobes = ~0u;

/// How one surface point scatters light, textures looked up: a list of lobes, layer below layer. Directions point away
/// from the surface.
///
/// What lies below a layer gets 1 minus that layer's directional albedo at the viewer's angle ("albedo scaling"). So
/// the diffuse part stays a colour times the irradiance, which is what records hold; the price is that swapping the two
/// directions changes the value a little.
struct Bsdf {
    glm::vec3 normal{0.0f, 0.0f, 1.0f};  ///< shading, unit, on the viewer's side
    glm::vec3 geometric_normal{0.0f, 0.0f, 1.0f};
    std::uint32_t count = 0;
    Lobe lobe[kMostLobes];  ///< from the top; at most one of a kind

    void add(const Lobe& below) { lobe[count++] = below; }
    const Lobe* begin() const { return lobe; }
    const Lobe* end() const { return lobe + count; }

    /// @param wanted  (lobe) to whether it is one of them
    template <typename Wanted>
    LobeSet those(const Wanted& wanted) const
    {
        LobeSet set = 0;
        for (std::uint32_t i = 0; i < count; ++i) set |= static_cast<LobeSet>(wanted(lobe[i])) << i;
        return set;
    }
    /// The lobes of a set by themselves, as if nothing lay above them but each other.
    Bsdf only(LobeSet set) const;
};

/// The lobes that are lit by irradiance, and the others, which it takes more to light.
inline LobeSet diffuse_lobes(const Bsdf& bsdf) { return bsdf.those(is_diffuse); }
inline LobeSet glossy_lobes(const Bsdf& bsdf)
{
    return bsdf.those([](const Lobe& lobe) { return !is_diffuse(lobe); });
}
/// Of the latter those that scatter to the viewer's side.
inline LobeSet reflecting_lobes(const Bsdf& bsdf)
{
    return bsdf.those([](const Lobe& lobe) { return !is_diffuse(lobe) && !transmits(lobe); });
}
inline LobeSet transmitting_lobes(const Bsdf& bsdf) { return bsdf.those(transmits); }
/// At visible points the lobes that are lit by irradiance on the other side; none where rays bring what comes from
/// there, since another lobe lets light through as well.
inline LobeSet lobes_lit_behind(const Bsdf& bsdf)
{
    const LobeSet behind = bsdf.those(is_diffuse_behind);
    return behind == transmitting_lobes(bsdf) ? behind : 0u;
}

/// Width of the narrowest lobe of a set; 1 if it is empty.
float narrowest(const Bsdf& bsdf, LobeSet set);

/// What a lobe leaves of the light to those below it.
glm::vec3 left_below(const Bsdf& bsdf, std::uint32_t lobe, glm::vec3 outgoing);

// All below take the lobes of a set as the layers above leave them, whether those are in the set or not.

/// Directional albedo: what a uniform light of radiance 1 from all directions is scattered to the viewer.
glm::vec3 albedo(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes);

/// f(outgoing, incoming) [1/sr] without the cosine; 0 where a direction is on the wrong side of the shading or the
/// geometric normal (the diffuse part is also seen from below the shading normal: smooth silhouettes stay lit).
glm::vec3 evaluate(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming, LobeSet lobes = kAllLobes);

struct BsdfSample {
    glm::vec3 incoming{0.0f};  ///< unit
    glm::vec3 weight{0.0f};    ///< f |cosine| / density; 0: no light can come from there
    float density = 0.0f;      ///< [1/sr]
    float alpha = 1.0f;        ///< width of the lobe that was picked; 1: diffuse
};
/// Samples lobes, each in proportion to its directional albedo.
/// @param choice  in [0, 1): picks the lobe   @param u  in [0, 1)^2: the direction
BsdfSample sample(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u, LobeSet lobes = kAllLobes);
/// Density with which sample() picks `incoming` [1/sr].
float density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming, LobeSet lobes = kAllLobes);

/// Some of a surface's lobes as one viewer sees them: the same functions, for many directions.
class SeenLobes {
public:
    /// @param bsdf  has to outlive this
    SeenLobes(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes);

    glm::vec3 evaluate(glm::vec3 incoming) const;
    /// The same for all lanes.
    ColorLanes evaluate(const DirectionLanes& incoming) const;
    float density(glm::vec3 incoming) const;
    BsdfSample sample(float choice, glm::vec2 u) const;

private:
    Scattering scattering(const ScatterPair& pair) const;
    std::uint32_t pick(float rest) const;

    const Bsdf* bsdf_;
    glm::vec3 outgoing_;
    LobeSet lobes_;
    LobeView view_[kMostLobes];  // of those in the set
    float total_ = 0.0f;         // of the shares
};

}  // namespace rcs
