#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/glm.hpp>

namespace rcs {

// The microfacet distribution of Walter et al. 2007 with Smith's height-correlated masking (Heitz 2014). `alpha`
// is the width, cosines are to the shading normal and > 0.

/// D(h) [1/sr]. @param sine2  squared sine between h and the normal: its cosine would lose a narrow lobe to rounding
inline float ggx_distribution(float sine2, float alpha)
{
    const float a2 = alpha * alpha;
    const float t = sine2 + a2 * (1.0f - sine2);
    return a2 / (std::numbers::pi_v<float> * t * t);
}

/// The same, its peak spread to about the height of that of a wider lobe, its tails as they are: what a lobe throws far
/// beside the mirror direction grows as the square of its width, so that one that is wider as a whole lights up what
/// hardly anything comes to. Over the slopes of h the distribution is cut off at its value at a radius, and a
/// paraboloid inside brings what that takes.
/// @param peak_alpha  > alpha
inline float ggx_spread_distribution(float sine2, float alpha, float peak_alpha)
{
    const float a2 = alpha * alpha, radius2 = 2.0f * (peak_alpha * peak_alpha - a2);
    const float cosine2 = std::max(1.0f - sine2, 1e-12f);
    const float inside = 1.0f - sine2 / (cosine2 * radius2);
    if (!(inside > 0.0f)) return ggx_distribution(sine2, alpha);
    const float edge = a2 + radius2;
    return (a2 + 2.0f * radius2 * inside) / (std::numbers::pi_v<float> * edge * edge * cosine2 * cosine2);
}

/// cosine * sqrt(1 + alpha^2 tan^2): cosine (1 + 2 Lambda).
inline float ggx_slant(float cosine, float alpha)
{
    const float a2 = alpha * alpha;
    return std::sqrt(a2 + (1.0f - a2) * cosine * cosine);
}

/// G2(o, i) / (4 cos_o cos_i). @param slant_o, slant_i  of the two directions
inline float ggx_visibility(float cosine_o, float slant_o, float cosine_i, float slant_i)
{
    return 0.5f / std::max(cosine_i * slant_o + cosine_o * slant_i, 1e-30f);
}

/// Density of reflected directions per D(h): G1(o) / (4 cos_o).
inline float ggx_density_factor(float cosine_o, float slant_o) { return 0.5f / (cosine_o + slant_o); }

/// A microfacet normal in proportion to how much of its kind `outgoing` sees (Heitz 2018, "Sampling the GGX
/// distribution of visible normals"). @param outgoing  unit, z along the normal, z >= 0
/// @param disc  uniform in the unit disc
inline glm::vec3 visible_normal(glm::vec3 outgoing, float alpha, glm::vec2 disc)
{
    // Stretched to alpha = 1 the facets are a hemisphere: its projection is a half disc and a squeezed half disc.
    const glm::vec3 view = glm::normalize(glm::vec3(alpha * outgoing.x, alpha * outgoing.y, outgoing.z));
    const float across2 = view.x * view.x + view.y * view.y;
    const glm::vec3 side =
        across2 > 0.0f ? glm::vec3(-view.y, view.x, 0.0f) / std::sqrt(across2) : glm::vec3(1.0f, 0.0f, 0.0f);
    const glm::vec3 up = glm::cross(view, side);
    const float a = disc.x;
    const float squeeze = 0.5f * (1.0f + view.z);
    const float b = (1.0f - squeeze) * std::sqrt(std::max(0.0f, 1.0f - a * a)) + squeeze * disc.y;
    const glm::vec3 n = a * side + b * up + std::sqrt(std::max(0.0f, 1.0f - a * a - b * b)) * view;
    return glm::normalize(glm::vec3(alpha * n.x, alpha * n.y, std::max(1e-6f, n.z)));
}

/// @param u  in [0, 1)^2
inline glm::vec3 sample_visible_normal(glm::vec3 outgoing, float alpha, glm::vec2 u)
{
    const float phi = 2.0f * std::numbers::pi_v<float> * u.y;
    return visible_normal(outgoing, alpha, std::sqrt(u.x) * glm::vec2(std::cos(phi), std::sin(phi)));
}

/// (1 - cosine)^5 of Schlick's approximation.
inline float schlick_weight(float cosine)
{
    const float x = std::clamp(1.0f - cosine, 0.0f, 1.0f);
    const float x2 = x * x;
    return x2 * x2 * x;
}

}  // namespace rcs
