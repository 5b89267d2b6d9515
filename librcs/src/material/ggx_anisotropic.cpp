#include "material/ggx_anisotropic.h"

#include <array>
#include <cstddef>

#include "material/ggx.h"

namespace rcs {
namespace {

// Nodes along roughness (square root of alpha), strength (square root of the stretch), cosine and azimuth of the
// viewer.
constexpr std::array<std::size_t, 4> kAnisotropicNodes{14, 9, 16, 7};
constexpr std::size_t kCells =
    kAnisotropicNodes[0] * kAnisotropicNodes[1] * kAnisotropicNodes[2] * kAnisotropicNodes[3];
constexpr int kFacetRadii = 14, kFacetAngles = 20;  // of the quadrature over the visible facets

using AnisotropicTable = std::array<GgxAlbedo, kCells>;

/// Cosines are denser near grazing: nodes are even in their square roots.
float axis_value(std::size_t axis, std::size_t node)
{
    return static_cast<float>(node) / static_cast<float>(kAnisotropicNodes[axis] - 1);
}

std::array<glm::vec3, kFacetRadii * kFacetAngles> make_facet_disc()
{
    std::array<glm::vec3, kFacetRadii * kFacetAngles> disc;  // position, weight
    for (int i = 0; i < kFacetRadii; ++i) {
        // Denser towards the rim, where facets turn away fastest: radius^2 = 1 - rest^2.
        const float rest = 1.0f - (static_cast<float>(i) + 0.5f) / kFacetRadii;
        const float radius = std::sqrt(1.0f - rest * rest);
        for (int j = 0; j < kFacetAngles; ++j) {
            const float phi =
                2.0f * std::numbers::pi_v<float> * (static_cast<float>(j) + 0.5f * (i % 2)) / kFacetAngles;
            disc[static_cast<std::size_t>(i * kFacetAngles + j)] = {radius * std::cos(phi), radius * std::sin(phi),
                                                                    2.0f * rest / (kFacetRadii * kFacetAngles)};
        }
    }
    return disc;
}

/// Mean of G2 / G1 over visible normals, split by Schlick's weight.
template <typename Disc>
GgxAlbedo integrate(glm::vec3 outgoing, glm::vec2 widths, const Disc& disc)
{
    const float slant_o = ggx_slant(outgoing, widths);
    GgxAlbedo sum{0.0f, 0.0f};
    for (const glm::vec3& point : disc) {
        const glm::vec3 h = visible_normal(outgoing, widths, {point.x, point.y});
        const float cosine_h = glm::dot(outgoing, h);
        const glm::vec3 incoming = 2.0f * cosine_h * h - outgoing;
        if (incoming.z <= 0.0f) continue;
        const float ratio = ggx_visibility(outgoing.z, slant_o, incoming.z, ggx_slant(incoming, widths)) * incoming.z /
                            ggx_density_factor(outgoing.z, slant_o);
        const float fresnel = schlick_weight(cosine_h);
        sum.scale += point.z * ratio * (1.0f - fresnel);
        sum.bias += point.z * ratio * fresnel;
    }
    return sum;
}

AnisotropicTable make_anisotropic_table()
{
    const auto disc = make_facet_disc();
    AnisotropicTable table;
    std::size_t cell = 0;
    for (std::size_t r = 0; r < kAnisotropicNodes[0]; ++r) {
        for (std::size_t s = 0; s < kAnisotropicNodes[1]; ++s) {
            const float roughness = std::max(axis_value(0, r), 0.0316f), strength = axis_value(1, s);
            const glm::vec2 widths = stretched_widths(roughness * roughness, strength * strength);
            for (std::size_t c = 0; c < kAnisotropicNodes[2]; ++c) {
                const float cosine = std::max(axis_value(2, c) * axis_value(2, c), 1e-4f);
                const float sine = std::sqrt(1.0f - cosine * cosine);
                for (std::size_t a = 0; a < kAnisotropicNodes[3]; ++a) {
                    const float azimuth = 0.5f * std::numbers::pi_v<float> * axis_value(3, a);
                    const GgxAlbedo e =
                        integrate({sine * std::cos(azimuth), sine * std::sin(azimuth), cosine}, widths, disc);
                    // Less a mirror's, the part by Schlick's weight is nearly linear between the nodes.
                    const float total = e.scale + e.bias;
                    table[cell++] = {total, e.bias / total - schlick_weight(cosine)};
                }
            }
        }
    }
    return table;
}

}  // namespace

GgxAlbedo ggx_albedo(glm::vec3 outgoing, float alpha, float stretch)
{
    static const AnisotropicTable table = make_anisotropic_table();
    const float cosine = std::clamp(outgoing.z, 1e-6f, 1.0f);
    const float at[4] = {std::sqrt(alpha), std::sqrt(stretch), std::sqrt(cosine),
                         std::atan2(std::abs(outgoing.y), std::abs(outgoing.x)) * 2.0f * std::numbers::inv_pi_v<float>};
    std::size_t node[4];
    float fraction[4];
    for (std::size_t k = 0; k < 4; ++k) {
        const float x = std::clamp(at[k], 0.0f, 1.0f) * static_cast<float>(kAnisotropicNodes[k] - 1);
        node[k] = std::min(static_cast<std::size_t>(x), kAnisotropicNodes[k] - 2);
        fraction[k] = x - static_cast<float>(node[k]);
    }
    float total = 0.0f, share = 0.0f;
    for (std::size_t corner = 0; corner < 16; ++corner) {
        std::size_t cell = 0;
        float weight = 1.0f;
        for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t up = corner >> k & 1u;
            cell = cell * kAnisotropicNodes[k] + node[k] + up;
            weight *= up != 0u ? fraction[k] : 1.0f - fraction[k];
        }
        total += weight * table[cell].scale;
        share += weight * table[cell].bias;
    }
    const float fresnel = std::clamp(schlick_weight(cosine) + share, 0.0f, 1.0f);
    return {total * (1.0f - fresnel), total * fresnel};
}

}  // namespace rcs
