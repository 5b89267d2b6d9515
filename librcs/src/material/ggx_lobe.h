#pragma once

#include <algorithm>

#include "material/ggx.h"
#include "material/ggx_albedo.h"
#include "material/lobe.h"
#include "util/basis.h"

namespace rcs {

// What the kinds of lobes that are GGX share. Single scattering with Smith's height-correlated masking (Heitz 2014) and
// Schlick's Fresnel between f0 and f90; what it loses is given back by the factor 1 + f0 (1 - E) / E (Turquin 2019; E:
// the lobe's directional albedo for Fresnel = 1): a white metal reflects everything at every roughness.

/// @param e  of the lobe
inline void see_ggx(glm::vec3 f0, float f90, GgxAlbedo e, LobeView& v)
{
    v.inverse_total = 1.0f / (e.scale + e.bias);
    v.gain = 1.0f + f0 * (v.inverse_total - 1.0f);
    v.albedo = glm::min(v.gain * (f0 * e.scale + f90 * e.bias), glm::vec3(1.0f));
}

inline void see_ggx(glm::vec3 f0, float f90, LobeView& v)
{
    v.slant = ggx_slant(v.cosine, v.lobe->alpha);
    see_ggx(f0, f90, ggx_albedo(v.cosine, v.lobe->alpha), v);
}

/// What a GGX layer leaves to those below it.
inline glm::vec3 left_by_ggx(const LobeView& v) { return 1.0f - v.albedo; }

/// D V without Fresnel, and the density of sampling it.
struct GgxValue {
    float value, density;
};
inline GgxValue ggx_value(const LobeView& v, const ScatterPair& pair)
{
    const float d = v.lobe->peak_alpha > v.lobe->alpha
                        ? ggx_spread_distribution(pair.sine2_h, v.lobe->alpha, v.lobe->peak_alpha)
                        : ggx_distribution(pair.sine2_h, v.lobe->alpha);
    return {d * ggx_visibility(v.cosine, v.slant, pair.cosine_i, ggx_slant(pair.cosine_i, v.lobe->alpha)),
            d * ggx_density_factor(v.cosine, v.slant)};
}

inline void add_ggx(glm::vec3 f0, float f90, const LobeView& v, const ScatterPair& pair, Scattering& s)
{
    const GgxValue g = ggx_value(v, pair);
    s.value += v.gain * (f0 + (f90 - f0) * schlick_weight(pair.cosine_h)) * g.value;
    s.density += v.share * g.density;
}

/// By visible normals (Heitz 2018); may lie below the surface.
inline glm::vec3 sample_ggx(const LobeView& v, glm::vec3 outgoing, glm::vec2 u)
{
    const Basis basis(v.normal);
    const glm::vec3 h = basis.from_local(sample_visible_normal(basis.to_local(outgoing), v.lobe->alpha, u));
    return glm::normalize(2.0f * glm::dot(outgoing, h) * h - outgoing);
}

}  // namespace rcs
