#include "material/bsdf.h"

#include <algorithm>
#include <cmath>

namespace rcs {
namespace {

// At exactly grazing view the lobes have no limit in float; a millionth above it they do.
constexpr float kLeastCosine = 1e-6f;

constexpr bool has(LobeSet set, std::uint32_t i) { return (set >> i & 1u) != 0u; }

float mean(glm::vec3 c) { return (c.r + c.g + c.b) * (1.0f / 3.0f); }

/// A lobe as if nothing lay above it.
template <typename Kind>
void look_at(Kind kind, const Bsdf& b, std::uint32_t lobe, glm::vec3 outgoing, LobeView& v)
{
    v.lobe = &b.lobe[lobe];
    v.normal = b.normal;
    v.outgoing = outgoing;
    v.cosine = std::clamp(glm::dot(b.normal, outgoing), kLeastCosine, 1.0f);
    v.gain = glm::vec3(1.0f);
    kind.see(v);
}

/// The lobes of a set as one viewer sees them, the layers' shares multiplied in.
struct Layers {
    LobeView view[kMostLobes];
    float total = 0.0f;  ///< of the shares

    Layers(const Bsdf& b, glm::vec3 outgoing, LobeSet set)
    {
        const LobeSet lobes = set & ((1u << b.count) - 1u);
        for (std::uint32_t i = b.count; i-- > 0;) {
            // Layers count even if they are not in the set, unless nothing of it lies below them.
            if (lobes >> i == 0u) continue;
            LobeView& v = view[i];
            with_kind(b.lobe[i].kind, [&](auto kind) {
                look_at(kind, b, i, outgoing, v);
                if (!kind.covers) return;
                const glm::vec3 left = kind.leaves(v);
                for (std::uint32_t below = i + 1; below < b.count; ++below)
                    if (lobes >> below != 0u) view[below].lies_below(left);
            });
        }
        for (std::uint32_t i = 0; i < b.count; ++i) {
            if (!has(lobes, i)) continue;
            view[i].share = mean(view[i].albedo);
            total += view[i].share;
        }
    }
};

Scattering scattering(const Bsdf& b, const Layers& layers, LobeSet set, const ScatterPair& pair)
{
    Scattering s;
    const bool viewer_above = glm::dot(b.normal, pair.outgoing) > 0.0f;
    for (std::uint32_t i = b.count; i-- > 0;) {
        if (!has(set, i)) continue;
        with_kind(b.lobe[i].kind, [&](auto kind) {
            if (kind.transmits == pair.transmitted && (kind.is_diffuse || viewer_above))
                kind.add(layers.view[i], pair, s);
        });
    }
    s.density = layers.total > 0.0f ? s.density / layers.total : 0.0f;
    return s;
}

Scattering scattering(const Bsdf& b, LobeSet set, glm::vec3 outgoing, glm::vec3 incoming)
{
    const ScatterPair pair(b.normal, b.geometric_normal, outgoing, incoming);
    if (!pair.valid) return {};
    return scattering(b, Layers(b, outgoing, set), set, pair);
}

/// The lobe that a number in [0, total) falls to: what reflects from the bottom, then what transmits.
std::uint32_t pick(const Bsdf& b, const Layers& layers, LobeSet set, float rest)
{
    std::uint32_t picked = 0;
    for (const bool through : {false, true}) {
        for (std::uint32_t i = b.count; i-- > 0;) {
            if (!has(set, i) || transmits(b.lobe[i]) != through || !(layers.view[i].share > 0.0f)) continue;
            picked = i;
            if ((rest -= layers.view[i].share) < 0.0f) return picked;
        }
    }
    return picked;
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
        if (!kind.covers) return glm::vec3(1.0f);
        LobeView view;
        look_at(kind, bsdf, lobe, outgoing, view);
        return glm::vec3(kind.leaves(view));
    });
}

glm::vec3 albedo(const Bsdf& bsdf, glm::vec3 outgoing, LobeSet lobes)
{
    const Layers layers(bsdf, outgoing, lobes);
    glm::vec3 sum(0.0f);
    for (std::uint32_t i = bsdf.count; i-- > 0;)
        if (has(lobes, i)) sum += layers.view[i].albedo;
    return sum;
}

glm::vec3 evaluate(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming, LobeSet lobes)
{
    return scattering(bsdf, lobes, outgoing, incoming).value;
}

float density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming, LobeSet lobes)
{
    return scattering(bsdf, lobes, outgoing, incoming).density;
}

BsdfSample sample(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u, LobeSet lobes)
{
    const float cosine_o = glm::dot(bsdf.normal, outgoing);
    const Layers layers(bsdf, outgoing, lobes);
    BsdfSample result;
    if (!(layers.total > 0.0f)) return result;
    const LobeView& view = layers.view[pick(bsdf, layers, lobes, choice * layers.total)];
    const bool is_drawn = with_kind(view.lobe->kind, [&](auto kind) {
        if (!kind.is_diffuse && !(cosine_o > 0.0f)) return false;
        result.alpha = view.lobe->alpha;
        result.incoming = kind.sample(view, outgoing, u);
        const float cosine_i = glm::dot(result.incoming, bsdf.normal);
        if (!kind.is_diffuse && !(cosine_i > 0.0f)) return false;
        if (kind.transmits) result.incoming -= 2.0f * cosine_i * bsdf.normal;
        return true;
    });
    if (!is_drawn) return result;
    const ScatterPair pair(bsdf.normal, bsdf.geometric_normal, outgoing, result.incoming);
    if (!pair.valid) return result;
    const Scattering s = scattering(bsdf, layers, lobes, pair);
    result.density = s.density;
    if (s.density > 0.0f) result.weight = s.value * (std::abs(glm::dot(bsdf.normal, result.incoming)) / s.density);
    return result;
}

}  // namespace rcs
