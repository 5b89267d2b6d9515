#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <glm/glm.hpp>

#include "material/bsdf.h"

namespace rcs::test {

/// A surface of lobes, from the top.
inline Bsdf surface_of(std::initializer_list<Lobe> lobes, glm::vec3 normal = {0.0f, 0.0f, 1.0f})
{
    Bsdf b;
    b.normal = b.geometric_normal = normal;
    for (const Lobe& lobe : lobes) b.add(lobe);
    return b;
}

/// The surface's lobe of a kind; one of colour 0, level 0 and width 1 if it has none.
template <typename Kind>
Lobe lobe_of(const Bsdf& bsdf)
{
    for (const Lobe& lobe : bsdf)
        if (lobe.kind == number_of_kind<Kind>()) return lobe;
    return make_lobe<Kind>(glm::vec3(0.0f), 0.0f);
}

/// Directional albedos for a viewer at some azimuth. @param cosine  to the shading normal
inline glm::vec3 seen_at(const Bsdf& b, float cosine)
{
    const Basis basis(b.normal);
    return std::sqrt(std::max(0.0f, 1.0f - cosine * cosine)) * basis.x + cosine * b.normal;
}
inline glm::vec3 diffuse_albedo(const Bsdf& b, float cosine) { return albedo(b, seen_at(b, cosine), diffuse_lobes(b)); }
inline glm::vec3 specular_albedo(const Bsdf& b, float cosine)
{
    return albedo(b, seen_at(b, cosine), reflecting_lobes(b));
}
inline glm::vec3 evaluate_glossy(const Bsdf& b, glm::vec3 o, glm::vec3 i) { return evaluate(b, o, i, glossy_lobes(b)); }
inline BsdfSample sample_glossy(const Bsdf& b, glm::vec3 o, float choice, glm::vec2 u)
{
    return sample(b, o, choice, u, glossy_lobes(b));
}
inline float glossy_density(const Bsdf& b, glm::vec3 o, glm::vec3 i) { return density(b, o, i, glossy_lobes(b)); }

}  // namespace rcs::test
