#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

#include "material/lobe.h"
#include "material/lobes/anisotropic.h"
#include "material/lobes/coat.h"
#include "material/lobes/diffuse.h"
#include "material/lobes/diffuse_transmission.h"
#include "material/lobes/sheen.h"
#include "material/lobes/specular.h"
#include "material/lobes/transmission.h"

namespace rcs {

/// All kinds of lobes, in the order of the layers from the top: a kind that `covers` says what it leaves at the
/// viewer's angle to those below. Each says in its own file how it is made from a material (may_be, width, make), what
/// a viewer sees of it (see: directional albedo; leaves), how it scatters (add, sample), and
///   transmits      scatters to the other side
///   passes_rays    rays of light go straight on through it, as one of their chances
///   is_diffuse     is lit by irradiance
///   is_diffuse_behind  is lit by irradiance on the other side
///   keeps_tails    is GGX about the mirror direction, whose peak can be spread by itself (Lobe::peak_alpha)
///   is_recordable  is symmetric about the mirror direction and like any other of its width: radiance records can light
///   it
using LobeKinds = std::tuple<Coat, Sheen, Anisotropic, Specular, Transmission, DiffuseTransmission, Diffuse>;
inline constexpr std::size_t kMostLobes = std::tuple_size_v<LobeKinds>;

/// Calls visit(Kind{}) for the kind with a number.
template <std::size_t Number = 0, typename Visit>
decltype(auto) with_kind(std::uint32_t number, Visit&& visit)
{
    if constexpr (Number + 1 == kMostLobes)
        return visit(std::tuple_element_t<Number, LobeKinds>{});
    else if (number == Number + 1)
        return visit(std::tuple_element_t<Number, LobeKinds>{});
    else
        return with_kind<Number + 1>(number, std::forward<Visit>(visit));
}

/// Calls visit(Kind{}) for all kinds from the top.
template <typename Visit>
void for_each_kind(Visit&& visit)
{
    std::apply([&](auto... kind) { (visit(kind), ...); }, LobeKinds{});
}
/// Whether holds(Kind{}) for any.
template <typename Holds>
bool any_kind(Holds&& holds)
{
    return std::apply([&](auto... kind) { return (holds(kind) || ...); }, LobeKinds{});
}

template <typename Kind, std::size_t Number = 0>
constexpr std::uint8_t number_of_kind()
{
    if constexpr (std::is_same_v<std::tuple_element_t<Number, LobeKinds>, Kind>)
        return static_cast<std::uint8_t>(Number + 1);
    else
        return number_of_kind<Kind, Number + 1>();
}

/// @param width  GGX alpha
template <typename Kind>
Lobe make_lobe(glm::vec3 color, float level = 1.0f, float width = 1.0f)
{
    return {color, level, width, width, number_of_kind<Kind>(), 0u, 0u};
}

inline bool transmits(const Lobe& lobe)
{
    return with_kind(lobe.kind, [](auto kind) { return kind.transmits; });
}
inline bool passes_rays(const Lobe& lobe)
{
    return with_kind(lobe.kind, [](auto kind) { return kind.passes_rays; });
}
inline bool is_diffuse(const Lobe& lobe)
{
    return with_kind(lobe.kind, [](auto kind) { return kind.is_diffuse; });
}
inline bool is_diffuse_behind(const Lobe& lobe)
{
    return with_kind(lobe.kind, [](auto kind) { return kind.is_diffuse_behind; });
}

/// Whether a lobe of a visible point is lit by radiance records.
inline bool lit_by_records(const Lobe& lobe)
{
    return with_kind(lobe.kind, [](auto kind) { return kind.is_recordable; }) && lobe.alpha >= kLeastRecordAlpha;
}
/// ... or else by rays along it.
inline bool lit_by_rays(const Lobe& lobe) { return !is_diffuse(lobe) && !lit_by_records(lobe); }
/// Whether it shows what is straight behind it, or else scatters what passes.
inline bool shows_straight(const Lobe& lobe) { return passes_rays(lobe) && lobe.alpha <= kStraightAlpha; }

/// Its peak as wide as `alpha` at least: tails stay, but of a kind that is widened as a whole.
inline Lobe widened(Lobe lobe, float alpha)
{
    lobe.peak_alpha = std::max(lobe.peak_alpha, alpha);
    if (!with_kind(lobe.kind, [](auto kind) { return kind.keeps_tails; })) lobe.alpha = lobe.peak_alpha;
    return lobe;
}
/// Widens it as lobes are at hits that light is gathered from. @param least  least_hit_alpha() of the rays
inline void widen_at_hit(Lobe& lobe, float least)
{
    if (lobe.alpha >= least) return;
    lobe = widened(lobe, with_kind(lobe.kind, [&](auto kind) {
                       return least_alpha_of(kind.reflectance(lobe), kind.keeps_tails ? least : kWholePart * least);
                   }));
}

}  // namespace rcs
