#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/glm.hpp>

#include "support/lobes.h"
#include "util/random.h"

/// Surfaces of one or a few lobes, and points to sample them with.
namespace rcs::test {

inline constexpr double kPi = std::numbers::pi;
inline const std::vector<float> kCosines{0.02f, 0.1f, 0.3f, 0.6f, 0.9f, 1.0f};

inline glm::vec3 direction(float cosine, float azimuth = 0.3f)
{
    const float sine = std::sqrt(1.0f - cosine * cosine);
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

inline Bsdf metal(float roughness, glm::vec3 f0 = glm::vec3(1.0f))
{
    return surface_of({make_lobe<Specular>(f0, 1.0f, ggx_width(roughness))});
}

inline Bsdf plastic(float roughness, glm::vec3 diffuse = glm::vec3(1.0f))
{
    return surface_of({make_lobe<Specular>(glm::vec3(0.04f), 1.0f, ggx_width(roughness)), make_lobe<Diffuse>(diffuse)});
}

inline Bsdf coated(float roughness, float coat_roughness, float strength = 0.7f, Bsdf below = {})
{
    if (below.count == 0) below = plastic(roughness, {0.8f, 0.4f, 0.2f});
    Bsdf b = surface_of({make_lobe<Coat>(glm::vec3(Coat::kF0), strength, ggx_width(coat_roughness))});
    for (const Lobe& lobe : below) b.add(lobe);
    return b;
}

inline Bsdf pane(float roughness, glm::vec3 transmission = {0.6f, 0.7f, 0.5f})
{
    const float alpha = ggx_width(roughness);
    return surface_of({make_lobe<Specular>(glm::vec3(0.04f), 1.0f, alpha),
                       make_lobe<Transmission>(transmission, 1.0f, alpha), make_lobe<Diffuse>(glm::vec3(0.2f))});
}

inline Bsdf sheen(float roughness, glm::vec3 color = glm::vec3(1.0f), Bsdf below = {})
{
    roughness = std::max(roughness, kLeastCharlieRoughness);
    Bsdf b = surface_of({make_lobe<Sheen>(color, roughness * roughness, roughness)});
    for (const Lobe& lobe : below) b.add(lobe);
    return b;
}

inline Bsdf brushed(float roughness, float strength, glm::vec3 f0 = glm::vec3(1.0f), float turn = 0.4f)
{
    Lobe lobe = make_lobe<Anisotropic>(f0, 1.0f, ggx_width(roughness));
    lobe.set_direction(strength * strength, turn);
    return surface_of({lobe});
}

inline Bsdf leaf(glm::vec3 through, glm::vec3 diffuse)
{
    return surface_of({make_lobe<Specular>(glm::vec3(0.04f), 1.0f, 0.3f), make_lobe<DiffuseTransmission>(through),
                       make_lobe<Diffuse>(diffuse)});
}

/// Stratified points for the samplers.
template <typename Visit>
void for_each_sample(int count, Visit&& visit)
{
    RandomStream random(7);
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < count; ++j) {
            const float choice = random.next();
            const glm::vec2 u((static_cast<float>(i) + random.next()) / static_cast<float>(count),
                              (static_cast<float>(j) + random.next()) / static_cast<float>(count));
            visit(choice, glm::min(u, glm::vec2(0x1.fffffep-1f)));
        }
}

}  // namespace rcs::test
