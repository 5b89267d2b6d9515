#include "material/ggx_albedo.h"

#include <array>
#include <cmath>
#include <numbers>

#include "material/ggx.h"

namespace rcs {
namespace {

constexpr int kNodes = 32;   // along each axis
constexpr int kRadii = 20;   // of the quadrature, by
constexpr int kAngles = 10;  // over half of the facets: the other half mirrors it

/// What is nearly linear between the nodes.
struct Node {
    float total;    // the albedo with Fresnel = 1
    float fresnel;  // the lobe's mean of Schlick's weight, less that of a mirror
};
using Table = std::array<std::array<Node, kNodes>, kNodes>;  // by roughness (sqrt of alpha), then cosine

// Near grazing both change over cosines like alpha: nodes are even in (1 + alpha) cosine / (cosine + alpha).
float cosine_of(float x, float alpha) { return std::min(x * alpha / (1.0f + alpha - x), 1.0f); }
float stretched(float cosine, float alpha) { return (1.0f + alpha) * cosine / (cosine + alpha); }

/// Points on half of the unit disc, and how much of it each stands for.
struct DiscPoint {
    glm::vec2 position;
    float weight;
};
using Disc = std::array<DiscPoint, kRadii * kAngles>;

Disc make_disc()
{
    Disc disc;
    for (int i = 0; i < kRadii; ++i) {
        // Denser towards the rim, where facets turn away fastest: radius^2 = 1 - rest^2.
        const float rest = 1.0f - (static_cast<float>(i) + 0.5f) / kRadii;
        const float radius = std::sqrt(1.0f - rest * rest);
        for (int j = 0; j < kAngles; ++j) {
            const float phi = std::numbers::pi_v<float> * ((static_cast<float>(j) + 0.5f) / kAngles - 0.5f);
            disc[static_cast<std::size_t>(i * kAngles + j)] = {radius * glm::vec2(std::cos(phi), std::sin(phi)),
                                                               2.0f * rest / (kRadii * kAngles)};
        }
    }
    return disc;
}

/// Mean of G2 / G1 over visible normals, which is the albedo, split by Schlick's weight.
GgxAlbedo integrate(float cosine, float alpha, const Disc& disc)
{
    const glm::vec3 outgoing(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
    const float slant_o = ggx_slant(cosine, alpha);
    GgxAlbedo sum{0.0f, 0.0f};
    for (const DiscPoint& point : disc) {
        const glm::vec3 h = visible_normal(outgoing, alpha, point.position);
        const float cosine_h = glm::dot(outgoing, h);
        const float cosine_i = 2.0f * cosine_h * h.z - cosine;
        if (cosine_i <= 0.0f) continue;
        const float slant_i = ggx_slant(cosine_i, alpha);
        const float ratio =
            ggx_visibility(cosine, slant_o, cosine_i, slant_i) * cosine_i / ggx_density_factor(cosine, slant_o);
        const float fresnel = schlick_weight(cosine_h);
        sum.scale += point.weight * ratio * (1.0f - fresnel);
        sum.bias += point.weight * ratio * fresnel;
    }
    return sum;
}

Table make_table()
{
    const Disc disc = make_disc();
    Table table;
    for (std::size_t j = 0; j < kNodes; ++j) {
        const float roughness = static_cast<float>(j) / (kNodes - 1);
        const float alpha = std::max(roughness * roughness, 1e-4f);
        for (std::size_t i = 0; i < kNodes; ++i) {
            const float cosine = cosine_of(static_cast<float>(i) / (kNodes - 1), alpha);
            const GgxAlbedo e = integrate(cosine, alpha, disc);
            const float total = e.scale + e.bias;
            table[j][i] = {total, e.bias / total - schlick_weight(cosine)};
        }
    }
    return table;
}

Node mix(const Node& a, const Node& b, float t)
{
    return {a.total + t * (b.total - a.total), a.fresnel + t * (b.fresnel - a.fresnel)};
}

}  // namespace

GgxAlbedo ggx_albedo(float cosine, float alpha)
{
    static const Table table = make_table();
    const float c = std::clamp(cosine, 0.0f, 1.0f);
    const float x = (kNodes - 1) * stretched(c, alpha), y = (kNodes - 1) * std::sqrt(alpha);
    const int i = std::min(static_cast<int>(x), kNodes - 2), j = std::min(static_cast<int>(y), kNodes - 2);
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
    const Node* lower = &table[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
    const Node* upper = lower + kNodes;
    const Node node = mix(mix(lower[0], lower[1], fx), mix(upper[0], upper[1], fx), fy);
    const float fresnel = std::clamp(schlick_weight(c) + node.fresnel, 0.0f, 1.0f);
    return {node.total * (1.0f - fresnel), node.total * fresnel};
}

}  // namespace rcs
