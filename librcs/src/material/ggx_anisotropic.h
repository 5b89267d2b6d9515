#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/glm.hpp>

#include "material/ggx_albedo.h"

namespace rcs {

// GGX that is wider along one tangent than along the other, with Smith's height-correlated masking (Heitz 2014).
// `widths`: alpha along x and y of the frame that directions are given in; z is the shading normal.

/// D(h) [1/sr].
inline float ggx_distribution(glm::vec3 h, glm::vec2 widths)
{
    const glm::vec2 slope = glm::vec2(h.x, h.y) / widths;
    const float t = glm::dot(slope, slope) + h.z * h.z;
    return 1.0f / (std::numbers::pi_v<float> * widths.x * widths.y * t * t);
}

/// cosine (1 + 2 Lambda).
inline float ggx_slant(glm::vec3 direction, glm::vec2 widths)
{
    return glm::length(glm::vec3(widths.x * direction.x, widths.y * direction.y, direction.z));
}

/// A microfacet normal in proportion to how much of its kind `outgoing` sees (Heitz 2018). @param disc  uniform in the
/// unit disc
inline glm::vec3 visible_normal(glm::vec3 outgoing, glm::vec2 widths, glm::vec2 disc)
{
    // Stretched to width 1 the facets are a hemisphere.
    const glm::vec3 view = glm::normalize(glm::vec3(widths.x * outgoing.x, widths.y * outgoing.y, outgoing.z));
    const float across2 = view.x * view.x + view.y * view.y;
    const glm::vec3 side =
        across2 > 0.0f ? glm::vec3(-view.y, view.x, 0.0f) / std::sqrt(across2) : glm::vec3(1.0f, 0.0f, 0.0f);
    const glm::vec3 up = glm::cross(view, side);
    const float squeeze = 0.5f * (1.0f + view.z);
    const float b = (1.0f - squeeze) * std::sqrt(std::max(0.0f, 1.0f - disc.x * disc.x)) + squeeze * disc.y;
    const glm::vec3 n = disc.x * side + b * up + std::sqrt(std::max(0.0f, 1.0f - disc.x * disc.x - b * b)) * view;
    return glm::normalize(glm::vec3(widths.x * n.x, widths.y * n.y, std::max(1e-6f, n.z)));
}

/// Widths of glTF's anisotropic lobe: across its direction the isotropic one's, along it wider.
/// @param stretch  squared strength, in [0, 1]
inline glm::vec2 stretched_widths(float alpha, float stretch) { return {alpha + stretch * (1.0f - alpha), alpha}; }

/// As ggx_albedo(), of stretched_widths(). @param outgoing  unit, in the lobe's frame, z clamped to > 0
/// Interpolated from a table, within 0.01 of the integral; the first call builds it (some 0.2 s).
GgxAlbedo ggx_albedo(glm::vec3 outgoing, float alpha, float stretch);

}  // namespace rcs
