#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "glossy/lobe_rays.h"
#include "glossy/past_lobes.h"

namespace rcs {

/// What one pixel's lobe reflects, and the standard error of its luminance.
struct LobeLight {
    glm::vec3 radiance{0.0f};
    float error = 0.0f;
};
/// The same of the light that surfaces reflect, and of gathered lamps.
struct LobeLights {
    LobeLight reflected, of_lamps;
    float distance = 0.0f;        ///< harmonic mean of the pixel's own rays' lengths [m]
    glm::vec3 reflectance{0.0f};  ///< albedo of its lobes towards the viewer
    float width = 0.0f;           ///< of the narrowest of them
};

/// Rays are shared between neighbours on the same surface (Stachowiak 2015, "Stochastic screen-space reflections"):
/// a pixel weighs every neighbour's hit point by its own lobe over the density with which the neighbour chose it,
/// and divides by the sum of weights. Lobes much narrower than what neighbours see in common share nothing, so a
/// mirror stays sharp.
class LobeSharing {
public:
    /// @param past  which pixels looked; null: all that look
    LobeSharing(const GBuffer& g, const View& view, const Shading& shading, const LobeSettings& settings,
                const PastLobes* past = nullptr)
        : g_(g), view_(view), shading_(shading), settings_(settings), past_(past)
    {
    }

    /// From the rays of the pixel and its neighbours, all of which must be in the ring.
    LobeLights share(std::size_t pixel, const RayRing& ring) const;
    /// From the pixel's own alone: right in the mean, and noisier.
    LobeLights by_own(std::size_t pixel, const RayRing& ring) const;
    /// The others among those, by its own rays. @param pixels  becomes them
    void find_neighbours(std::size_t pixel, const RayRing& ring, std::vector<std::size_t>& pixels) const;

private:
    /// How far a pixel shares [px].
    struct Reach {
        float rays = 0.0f, looks = 0.0f;
    };
    Reach reach_of(std::size_t pixel, const Bsdf& bsdf, const RayRing& ring) const;
    template <typename Visit>
    void each_neighbour(std::size_t pixel, float reach, const Visit& visit) const;
    bool looked(std::size_t pixel) const { return !past_ || past_->looks(pixel); }
    std::size_t looking_near(std::size_t pixel) const;

    const GBuffer& g_;
    const View& view_;
    const Shading& shading_;
    const LobeSettings& settings_;
    const PastLobes* past_;
};

}  // namespace rcs
