#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/glm.hpp>

namespace rcs {

// The microfacet distribution of Conty Estevez and Kulla 2017 ("Production friendly microfacet sheen BRDF") with their
// fit of its masking, as KHR_materials_sheen has it. `alpha`: squared roughness, cosines are to the shading normal.

/// Narrower lobes are taken for one of this roughness: they have no light but at grazing angles, and there too much.
inline constexpr float kLeastCharlieRoughness = 0.07f;

/// D(h) [1/sr]. @param sine2  squared sine between h and the normal
inline float charlie_distribution(float sine2, float alpha)
{
    const float inverse = 1.0f / alpha;
    return (2.0f + inverse) * std::pow(sine2, 0.5f * inverse) * (0.5f * std::numbers::inv_pi_v<float>);
}

/// Lambda of the fitted masking.
inline float charlie_lambda(float cosine, float alpha)
{
    const float t = (1.0f - alpha) * (1.0f - alpha);
    const auto fit = [t](float x) {
        const float a = std::lerp(21.5473f, 25.3245f, t), b = std::lerp(3.82987f, 3.32435f, t);
        const float c = std::lerp(0.19823f, 0.16801f, t), d = std::lerp(-1.97760f, -1.27393f, t);
        return a / (1.0f + b * std::pow(x, c)) + d * x + std::lerp(-4.32054f, -4.85967f, t);
    };
    return cosine < 0.5f ? std::exp(fit(cosine)) : std::exp(2.0f * fit(0.5f) - fit(1.0f - cosine));
}

/// G2(o, i) / (4 cos_o cos_i). @param lambda_o, lambda_i  of the two directions
inline float charlie_visibility(float cosine_o, float lambda_o, float cosine_i, float lambda_i)
{
    return 1.0f / std::max(4.0f * cosine_o * cosine_i * (1.0f + lambda_o + lambda_i), 1e-30f);
}

/// A microfacet normal with density D(h) cos(h); z along the shading normal. @param u  in [0, 1)^2
inline glm::vec3 sample_charlie_normal(float alpha, glm::vec2 u)
{
    const float sine = std::pow(u.x, alpha / (2.0f * alpha + 1.0f));
    const float phi = 2.0f * std::numbers::pi_v<float> * u.y;
    return {sine * std::cos(phi), sine * std::sin(phi), std::sqrt(std::max(0.0f, 1.0f - sine * sine))};
}

/// Directional albedo of the lobe with colour 1; more than 1 where narrow lobes are seen at grazing angles.
/// @param cosine  of the viewer, clamped to [0, 1]   @param alpha  in [kLeastCharlieRoughness^2, 1]. Interpolated from
/// a table, within 0.005 of the integral; the first call builds it (some 50 ms).
float charlie_albedo(float cosine, float alpha);

}  // namespace rcs
