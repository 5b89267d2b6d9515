#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "direct/direct.h"
#include "direct/direct_point.h"
#include "gbuffer/visible_points.h"
#include "rcs/camera.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Pixels whose direct light an earlier view knows. It is the mean of what the four pixels around the point had, or,
/// where these agree on which lamps are wholly seen and which wholly hidden, irradiance by the former's shapes alone.
class SparedPixels {
public:
    /// @param past  null: none is spared   @param workspaces  one per thread
    SparedPixels(const PastDirect* past, const DirectLight& light, const GBuffer& gbuffer, const View& view,
                 ThreadPool& pool, std::vector<DirectLight::Workspace>& workspaces);

    static constexpr int kReach = 2;  // [px]
    /// Calls visit(neighbour) for those that tell whether a lamp is in part hidden from a pixel, itself among them: 25
    /// have shot at least 50 rays at it.
    template <typename Visit>
    static void each_near(const GBuffer& g, std::size_t pixel, const Visit& visit)
    {
        for_each_near(g, pixel, kReach, visit);
    }

    bool has(std::size_t pixel) const { return how_[pixel] != How::sampled; }
    /// 1 for each of them, 0 for the other pixels.
    std::vector<std::uint8_t> all() const;
    /// What they saw of the lamps before; nothing of the others.
    std::vector<LampSight> sight() const;
    /// Gives them their light.
    void add_to(DirectLightResult& light) const;

private:
    enum class How : std::uint8_t { sampled, as_it_was, mean, by_shape };

    How find(const DirectLight& light, const GBuffer& g, std::size_t pixel, DirectLight::Workspace& w);
    How find_again(const GBuffer& g, std::size_t pixel) const;
    void sample_around(const GBuffer& g, ThreadPool& pool);
    std::optional<glm::vec3> by_shape(const DirectLight& light, const GBuffer& g, std::size_t pixel,
                                      const std::array<std::size_t, 4>& around, DirectLight::Workspace& w) const;

    std::size_t handed_on(std::size_t pixel) const;

    const PastDirect* past_;
    const View& view_;
    std::vector<How> how_;
    std::vector<glm::vec3> by_shape_;  // irradiance; empty where no lamp's shape tells it
};

}  // namespace rcs
