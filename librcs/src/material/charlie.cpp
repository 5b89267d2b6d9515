#include "material/charlie.h"

#include <array>
#include <cstddef>

namespace rcs {
namespace {

constexpr int kSheenNodes = 32;   // along each axis
constexpr int kHeights = 48;      // of the quadrature, by
constexpr int kSheenAngles = 32;  // over half of the directions: the other half mirrors it

// By roughness (square root of alpha), then cosine, both squares of what the nodes divide evenly: the albedo changes
// most for narrow lobes and near grazing.
using SheenTable = std::array<std::array<float, kSheenNodes>, kSheenNodes>;

constexpr float kLeastSheenCosine = 1e-4f;

float square_of_node(std::size_t n)
{
    const float x = static_cast<float>(n) / (kSheenNodes - 1);
    return x * x;
}

/// Incoming directions of the quadrature, denser towards the horizon where narrow lobes lie: cos = t^2.
struct Heights {
    std::array<float, kHeights> cosine, weight;

    Heights()
    {
        for (std::size_t i = 0; i < kHeights; ++i) {
            const float t = (static_cast<float>(i) + 0.5f) / kHeights;
            cosine[i] = t * t;
            weight[i] = 2.0f * t / kHeights;
        }
    }
};

float integrate(float cosine_o, float alpha, const Heights& heights, const std::array<float, kHeights>& lambda)
{
    const float sine_o = std::sqrt(1.0f - cosine_o * cosine_o), lambda_o = charlie_lambda(cosine_o, alpha);
    float sum = 0.0f;
    for (std::size_t i = 0; i < kHeights; ++i) {
        const float ci = heights.cosine[i], si = std::sqrt(1.0f - ci * ci);
        float d = 0.0f;
        for (int j = 0; j < kSheenAngles; ++j) {
            const float phi = std::numbers::pi_v<float> * (static_cast<float>(j) + 0.5f) / kSheenAngles;
            const float across2 = sine_o * sine_o + si * si + 2.0f * sine_o * si * std::cos(phi);
            const float up = cosine_o + ci;
            d += charlie_distribution(across2 / (across2 + up * up), alpha);
        }
        sum += heights.weight[i] * ci * charlie_visibility(cosine_o, lambda_o, ci, lambda[i]) * d;
    }
    return sum * 2.0f * std::numbers::pi_v<float> / kSheenAngles;
}

SheenTable make_sheen_table()
{
    const Heights heights;
    SheenTable table;
    for (std::size_t j = 0; j < kSheenNodes; ++j) {
        const float roughness = std::lerp(kLeastCharlieRoughness, 1.0f, square_of_node(j));
        const float alpha = roughness * roughness;
        std::array<float, kHeights> lambda;
        for (std::size_t i = 0; i < kHeights; ++i) lambda[i] = charlie_lambda(heights.cosine[i], alpha);
        for (std::size_t i = 0; i < kSheenNodes; ++i)
            table[j][i] = integrate(std::max(square_of_node(i), kLeastSheenCosine), alpha, heights, lambda);
    }
    return table;
}

}  // namespace

float charlie_albedo(float cosine, float alpha)
{
    static const SheenTable table = make_sheen_table();
    const float roughness =
        std::clamp((std::sqrt(alpha) - kLeastCharlieRoughness) / (1.0f - kLeastCharlieRoughness), 0.0f, 1.0f);
    const float x = (kSheenNodes - 1) * std::sqrt(std::clamp(cosine, 0.0f, 1.0f)),
                y = (kSheenNodes - 1) * std::sqrt(roughness);
    const int i = std::min(static_cast<int>(x), kSheenNodes - 2), j = std::min(static_cast<int>(y), kSheenNodes - 2);
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
    const float* lower = &table[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
    const float* upper = lower + kSheenNodes;
    return std::lerp(std::lerp(lower[0], lower[1], fx), std::lerp(upper[0], upper[1], fx), fy);
}

}  // namespace rcs
