#include <type_traits>

#include "material/bsdf.h"
#include "material/scatter_lanes.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

/// One lobe whose peak is not spread, as the formulas of its kind have it: a part of its caller, so that they become
/// vectors there. Lanes of which nothing comes are worked out as well, which not every kind's formulas stand.
template <typename Kind>
RCS_ALWAYS_INLINE void add_together(Kind kind, const Bsdf& bsdf, const LobeView& seen, const DirectionLanes& incoming,
                                    ColorLanes& f)
{
    const glm::vec3 normal = bsdf.normal, geometric = bsdf.geometric_normal;
    Lobe lobe = *seen.lobe;
    lobe.peak_alpha = lobe.alpha;  // as its caller knows, and the compiler has to: else these are no vectors
    LobeView view = seen;
    view.lobe = &lobe;
    if (!kind.is_diffuse && !(glm::dot(normal, view.outgoing) > 0.0f)) return;
    for (std::size_t lane = 0; lane < DirectionLanes::kWidth; ++lane) {
        const ScatterPair pair(normal, geometric, view.outgoing, incoming[lane]);
        Scattering s;
        kind.add(view, pair, s);
        const bool takes_part = pair.valid && pair.transmitted == kind.transmits;
        f.r[lane] += takes_part ? s.value.r : 0.0f;
        f.g[lane] += takes_part ? s.value.g : 0.0f;
        f.b[lane] += takes_part ? s.value.b : 0.0f;
    }
}

template <typename Kind>
void add_singly(Kind kind, const Bsdf& bsdf, const LobeView& view, const DirectionLanes& incoming, ColorLanes& f)
{
    if (!kind.is_diffuse && !(glm::dot(bsdf.normal, view.outgoing) > 0.0f)) return;
    for (std::size_t lane = 0; lane < DirectionLanes::kWidth; ++lane) {
        const ScatterPair pair(bsdf.normal, bsdf.geometric_normal, view.outgoing, incoming[lane]);
        if (!pair.valid || pair.transmitted != kind.transmits) continue;
        Scattering s;
        kind.add(view, pair, s);
        f.r[lane] += s.value.r;
        f.g[lane] += s.value.g;
        f.b[lane] += s.value.b;
    }
}

RCS_MULTIVERSION
void add_specular(const Bsdf& bsdf, const LobeView& view, const DirectionLanes& incoming, ColorLanes& f)
{
    add_together(Specular{}, bsdf, view, incoming, f);
}

RCS_MULTIVERSION
void add_coat(const Bsdf& bsdf, const LobeView& view, const DirectionLanes& incoming, ColorLanes& f)
{
    add_together(Coat{}, bsdf, view, incoming, f);
}

}  // namespace

ColorLanes SeenLobes::evaluate(const DirectionLanes& incoming) const
{
    ColorLanes f;
    for (std::uint32_t i = bsdf_->count; i-- > 0;) {
        if ((lobes_ >> i & 1u) == 0u) continue;
        with_kind(bsdf_->lobe[i].kind, [&](auto kind) {
            using Kind = decltype(kind);
            const bool is_spread = bsdf_->lobe[i].peak_alpha > bsdf_->lobe[i].alpha;
            if (std::is_same_v<Kind, Specular> && !is_spread)
                add_specular(*bsdf_, view_[i], incoming, f);
            else if (std::is_same_v<Kind, Coat> && !is_spread)
                add_coat(*bsdf_, view_[i], incoming, f);
            else
                add_singly(kind, *bsdf_, view_[i], incoming, f);
        });
    }
    return f;
}

}  // namespace rcs
