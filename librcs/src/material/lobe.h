#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <glm/glm.hpp>

#include "material/ggx.h"

namespace rcs {

/// One of the ways in which a surface point scatters light. What its values mean, its kind says (material/lobes/).
/// Without initialisers: a surface has room for more lobes than it ever has.
struct Lobe {
    static constexpr std::uint8_t kNone = 0;

    glm::vec3 color;         ///< reflectance at normal incidence, or albedo
    float level;             ///< reflectance at grazing incidence, or strength
    float alpha;             ///< width as that of a GGX lobe, in [kLeastAlpha, 1]; 1: diffuse
    float peak_alpha;        ///< at least alpha: its peak is spread to be as high as that of a GGX lobe so wide
    std::uint32_t kind : 8;  ///< place in LobeKinds, from 1; kNone: no lobe
    std::uint32_t stretch_code : 12, turn_code : 12;

    /// In [0, 1]: how much wider it is along its direction; 0: it has none.
    float stretch() const { return static_cast<float>(stretch_code) * (1.0f / 4095.0f); }
    /// Of its direction from the x axis of Basis(shading normal) [rad]; half a turn changes nothing.
    float turn() const { return static_cast<float>(turn_code) * (std::numbers::pi_v<float> / 4096.0f); }
    void set_direction(float stretch, float turn)
    {
        const float half_turns = turn * std::numbers::inv_pi_v<float>;
        stretch_code = static_cast<std::uint32_t>(std::lround(4095.0f * std::clamp(stretch, 0.0f, 1.0f)));
        turn_code = static_cast<std::uint32_t>(4096.0f * (half_turns - std::floor(half_turns))) & 4095u;
    }
};
static_assert(sizeof(Lobe) == 28);

/// As of Lobe.
struct LobeDirection {
    float stretch = 0.0f, turn = 0.0f;
};

/// A pair of directions, as all lobes need it.
struct ScatterPair {
    glm::vec3 outgoing, incoming;  ///< unit; incoming is mirrored to the viewer's side where it is `transmitted`
    float cosine_i, cosine_h, sine2_h;
    bool transmitted;
    bool valid;  ///< light goes that way at all; else the rest means nothing

    ScatterPair(glm::vec3 normal, glm::vec3 geometric_normal, glm::vec3 o, glm::vec3 i) : outgoing(o), incoming(i)
    {
        cosine_i = glm::dot(normal, incoming);
        const float above = glm::dot(geometric_normal, incoming);
        transmitted = cosine_i < 0.0f;
        valid = (cosine_i * above > 0.0f) & (glm::dot(geometric_normal, outgoing) > 0.0f);
        incoming -= (transmitted ? 2.0f * cosine_i : 0.0f) * normal;
        cosine_i = std::abs(cosine_i);
        const glm::vec3 sum = outgoing + incoming;
        const float length2 = glm::dot(sum, sum);
        const glm::vec3 cross = glm::cross(normal, sum);
        const float inverse2 = 1.0f / std::max(length2, 1e-30f);
        sine2_h = std::min(glm::dot(cross, cross) * inverse2, 1.0f);
        cosine_h = std::clamp(glm::dot(outgoing, sum) * std::sqrt(inverse2), 0.0f, 1.0f);
    }
};

/// A lobe as one viewer sees it, what the layers above it leave multiplied in.
struct LobeView {
    const Lobe* lobe;
    glm::vec3 normal;     ///< shading
    glm::vec3 outgoing;   ///< unit, towards the viewer
    float cosine, slant;  ///< of the viewer; slant as in ggx.h, of GGX lobes
    glm::vec3 gain;       ///< what multiplies the lobe's own formula
    float inverse_total;  ///< 1 / the directional albedo of a white lobe
    glm::vec3 albedo;     ///< directional
    float share;          ///< how often it is sampled, beside the others

    void lies_below(glm::vec3 left)
    {
        gain *= left;
        albedo *= left;
    }
};

/// f [1/sr] of lobes together, and the density of sampling them, not yet divided by the sum of shares.
struct Scattering {
    glm::vec3 value{0.0f};
    float density = 0.0f;
};

}  // namespace rcs
