#include "material/bsdf.h"

#include <algorithm>
#include <cmath>

#include "util/multiversion.h"

namespace rcs {
namespace {

// At exactly grazing view the lobes have no limit in float; a millionth above it they do.
constexpr float kLeastCosine = 1e-6f;

constexpr bool has(LobeSet set, std::uint32_t i) { return (set >> i & 1u) != 0u; }

float mean(glm::vec3 c) { return (c.r + c.g + c.b) * (1.0f / 3.0f); }

/// A lobe as if nothing lay above it.
template <typename Kind>
RCS_ALWAYS_INLINE LobeView look_at(Kind kind, const Bsdf& b, std::uint32_t lobe, glm::vec3 outgoing)
{
    LobeView v;
    v.lobe = &b.lobe[lobe];
    v.normal = b.normal;
    v.outgoing = outgoing;
    v.cosine = std::clamp(glm::dot(b.normal, outgoing), kLeastCosine, 1.0f);
    v.gain = glm::vec3(1.0f);
    kind.see(v);
    return v;
}

/// Calls visit(kind, number of the lobe, its view) for the lobes of a set from the top, the layers' shares multiplied
/// in. Part of its caller: what that does not read of a view is not computed.
template <typename Visit>
RCS_ALWAYS_INLINE void for_each_view(const Bsdf& b, glm::vec3 outgoing, LobeSet set, const Visit& visit)
{
    const LobeSet lobes = set & ((1u << b.count) - 1u);
    glm::vec3 left[kMostLobes];  // by each layer so far
    std::uint32_t layers = 0;
    // Layers count even if they are not in the set, unless nothing of it lies below them.
    for (std::uint32_t i = 0; lobes >> i != 0u; ++i) {
        with_kind(b.lobe[i].kind, [&](auto kind) {
            LobeView v = look_at(kind, b, i, outgoing);
            const std::uint32_t above = layers;
            if (kind.covers) left[layers++] = kind.leaves(v);
            if (!has(lobes, i)) return;
            for (std::uint32_t layer = above; layer-- > 0;) v.lies_below(left[layer]);
            v.share = mean(v.albedo);
            visit(kind, i, v);
        });
    }
}

/// Whether a lobe scatters that way at all.
template <typename Kind>
bool takes_part(Kind kind, const Bsdf& b, const ScatterPair& pair)
{
    return kind.transmits == pair.transmitted && (kind.is_diffuse || glm::dot(b.normal, pair.outgoing) > 0.0f);
}

/// Part of its caller, as for_each_view(). @param pair  valid
RCS_ALWAYS_INLINE Scattering scattering(const Bsdf& b, LobeSet set, const ScatterPair& pair)
{
    glm::vec3 value[kMostLobes];
    float density[kMostLobes], total = 0.0f;
    std::uint32_t count = 0;
    for_each_view(b, pair.outgoing, set, [&](auto kind, std::uint32_t, const LobeView& view) {
        Scattering s;
        if (takes_part(kind, b, pair)) kind.add(view, pair, s);
        value[count] = s.value;
        density[count++] = s.density;
        total += view.share;
    });
    Scattering sum;
    while (count-- > 0) {
        sum.value += value[count];
        sum.density += density[count];
    }
    sum.density = total > 0.0f ? sum.density / total : 0.0f;
    return sum;
}

}  // namespace

Bsdf Bsdf::only(LobeSet set) const
{
    Bsdf result;
    result.normal = normal;
    result.geometric_normal = geometric_normal;
    for (std::uint32_t i = 0; i < count; ++i)
        if (has(set, i)) result.add(lobe[i]);
    return result;
}

float narrowest(const Bsdf& bsdf, LobeSet set)
{
    float alpha = 1.0f;
    for (std::uint32_t i = 0; i < bsdf.count; ++i)
        if (has(set, i)) alpha = std::min(alpha, bsdf.lobe[i].alpha);
    return alpha;
}

glm::vec3 left_below(const Bsdf& bsdf, std::uint32_t lobe, glm::vec3 outgoing)
{
    return with_kind(bsdf.lobe[lobe].kind, [&](auto kind) {
        return kind.covers ? glm::vec3(kind.leaves(look_at(kind, bsdf, lobe, outgoing))) : glm::vec3(1.0f);
    });
}

glm::vec3 albedo(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes)
{
    glm::vec3 of_lobe[kMostLobes];
    std::uint32_t count = 0;
    for_each_view(bsdf, outgoing, lobes,
                  [&](auto, std::uint32_t, const LobeView& view) { of_lobe[count++] = view.albedo; });
    glm::vec3 sum(0.0f);
    while (count-- > 0) sum += of_lobe[count];
    return sum;
}

glm::vec3 evaluate(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming, LobeSet lobes)
{
    const ScatterPair pair(bsdf.normal, bsdf.geometric_normal, outgoing, incoming);
    return pair.valid ? scattering(bsdf, lobes, pair).value : glm::vec3(0.0f);
}

float density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming, LobeSet lobes)
{
    const ScatterPair pair(bsdf.normal, bsdf.geometric_normal, outgoing, incoming);
    return pair.valid ? scattering(bsdf, lobes, pair).density : 0.0f;
}

BsdfSample sample(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u, LobeSet lobes)
{
    return SeenLobes(bsdf, outgoing, lobes).sample(choice, u);
}

SeenLobes::SeenLobes(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes)
    : bsdf_(&bsdf), outgoing_(outgoing), lobes_(lobes)
{
    for_each_view(bsdf, outgoing, lobes, [&](auto, std::uint32_t lobe, const LobeView& seen) {
        view_[lobe] = seen;
        total_ += seen.share;
    });
}

/// @param pair  valid
Scattering SeenLobes::scattering(const ScatterPair& pair) const
{
    Scattering s;
    for (std::uint32_t i = bsdf_->count; i-- > 0;) {
        if (!has(lobes_, i)) continue;
        with_kind(bsdf_->lobe[i].kind, [&](auto kind) {
            if (takes_part(kind, *bsdf_, pair)) kind.add(view_[i], pair, s);
        });
    }
    s.density = total_ > 0.0f ? s.density / total_ : 0.0f;
    return s;
}

glm::vec3 SeenLobes::evaluate(glm::vec3 incoming) const
{
    const ScatterPair pair(bsdf_->normal, bsdf_->geometric_normal, outgoing_, incoming);
    return pair.valid ? scattering(pair).value : glm::vec3(0.0f);
}

float SeenLobes::density(glm::vec3 incoming) const
{
    const ScatterPair pair(bsdf_->normal, bsdf_->geometric_normal, outgoing_, incoming);
    return pair.valid ? scattering(pair).density : 0.0f;
}

/// The lobe that a number in [0, total) falls to: what reflects from the bottom, then what transmits.
std::uint32_t SeenLobes::pick(float rest) const
{
    std::uint32_t picked = 0;
    for (const bool through : {false, true}) {
        for (std::uint32_t i = bsdf_->count; i-- > 0;) {
            if (!has(lobes_, i) || transmits(bsdf_->lobe[i]) != through || !(view_[i].share > 0.0f)) continue;
            picked = i;
            if ((rest -= view_[i].share) < 0.0f) return picked;
        }
    }
    return picked;
}

BsdfSample SeenLobes::sample(float choice, glm::vec2 u) const
{
    const float cosine_o = glm::dot(bsdf_->normal, outgoing_);
    BsdfSample result;
    if (!(total_ > 0.0f)) return result;
    const LobeView& view = view_[pick(choice * total_)];
    const bool is_drawn = with_kind(view.lobe->kind, [&](auto kind) {
        if (!kind.is_diffuse && !(cosine_o > 0.0f)) return false;
        result.alpha = view.lobe->alpha;
        result.incoming = kind.sample(view, outgoing_, u);
        const float cosine_i = glm::dot(result.incoming, bsdf_->normal);
        if (!kind.is_diffuse && !(cosine_i > 0.0f)) return false;
        if (kind.transmits) result.incoming -= 2.0f * cosine_i * bsdf_->normal;
        return true;
    });
    if (!is_drawn) return result;
    const ScatterPair pair(bsdf_->normal, bsdf_->geometric_normal, outgoing_, result.incoming);
    if (!pair.valid) return result;
    const Scattering s = scattering(pair);
    result.density = s.density;
    if (s.density > 0.0f) result.weight = s.value * (std::abs(glm::dot(bsdf_->normal, result.incoming)) / s.density);
    return result;
}

}  // namespace rcs
