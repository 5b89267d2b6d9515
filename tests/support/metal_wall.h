#pragma once

#include <cstddef>

#include "glossy/traced_lobes.h"
#include "support/effect_scenes.h"
#include "support/seen_place.h"

namespace rcs::test {

/// A room lit through a window, of which a wall of metal is all that is seen.
struct MetalWall : SeenPlace {
    static constexpr int kSize = 64;
    static constexpr std::size_t kPixels = std::size_t{kSize} * kSize;

    explicit MetalWall(float roughness) : SeenPlace(scene_of(roughness), kSize) {}

    static Scene scene_of(float roughness)
    {
        Scene scene = window_room(1.0f);
        add_mesh(scene, quad({-1.9f, 0.1f, -1.98f}, {3.8f, 0, 0}, {0, 2.8f, 0}, add_surface(scene, metal(roughness))));
        return scene;
    }
    bool is_traced(std::size_t pixel) const { return points.covered(pixel) && shading.is_traced(pixel); }
    TracedLight trace(const LobeSettings& settings, GlossyStats& stats)
    {
        return trace_lobes(rays, HitRadiance(rays, nullptr, effects, nullptr), points, view, shading, settings, pool,
                           stats);
    }
    TracedLight trace(const LobeSettings& settings)
    {
        GlossyStats stats;
        return trace(settings, stats);
    }
    /// As bright everywhere, and so noisy.
    TracedLight even(float error) const
    {
        TracedLight light;
        light.radiance.assign(kPixels, glm::vec3(1.0f));
        light.reflectance.assign(kPixels, glm::vec3(1.0f));
        light.error.assign(kPixels, error);
        return light;
    }
};

}  // namespace rcs::test
