#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "glossy/lobe_looks.h"
#include "glossy/lobe_rays.h"
#include "glossy/past_lobes.h"
#include "glossy/traced_lobes.h"
#include "hit_light/hit_lobes.h"
#include "hit_light/hit_radiance.h"
#include "rays/packet.h"
#include "rays/shadow_batch.h"

namespace rcs {

/// A path along narrow lobes, at its next ray.
struct LobePath {
    Ray ray;
    std::size_t pixel = 0;
    LobeRay* first = nullptr;       ///< the pixel's ray that it began with, and that its light is for
    glm::vec3* of_lamps = nullptr;  ///< where that ray puts what gathered lamps send; null: the direct light has it
    glm::vec3 throughput{1.0f};     ///< since then
    float width = 0.0f;             ///< GGX width of the lobes so far, together
    float spread = 0.0f;            ///< width of the cone of directions that the path stands for, per length
    float length = 0.0f;            ///< up to this ray's origin [m]
    LitPart* lit = nullptr;         ///< of that ray; null: nothing is looked at
    SoftLight* soft = nullptr;      ///< of that ray; null: it is as other light
    int met = 0;                    ///< surfaces since the visible point
    SurfacePoint from;              ///< where this ray starts, if met > 0
    float density = 0.0f;    ///< of its direction [1/sr]: shares what shines with the sampling of lamps at `from`; 0:
                             ///< what shines has been counted; +inf: it has not
    float of_lights = 1.0f;  ///< what lamps and sky send along this ray is multiplied with
    std::uint64_t key = 0;
};

/// Shoots rays along the lobes of visible points and lights what they meet: by lamps and sky, beyond one bounce by the
/// light cache, and where that surface has a narrow lobe of its own (HitLobes) by a ray that goes on, a packet of them
/// for each further surface. The last ray still finds lamps and sky: with N bounces, N surfaces after the visible point
/// reflect.
class LobePaths {
public:
    struct Workspace {
        std::vector<LobePath> paths, next;
        HitPacket packet;
        ShadowBatch shadow;
        std::vector<PendingLight> lights;
        LobeLooks::Workspace looking;
        std::uint64_t rays = 0, shadow_rays = 0, looks = 0;

        Workspace() { reset(packet.ray); }
    };

    /// @param looks  null: there is nothing to look at   @param past  null: all pixels have all rays
    LobePaths(const RayScene& rays, const HitRadiance& light, const GBuffer& g, const View& view,
              const Shading& shading, const LobeSettings& settings, const LobeLooks* looks,
              const PastLobes* past = nullptr)
        : rays_(rays),
          light_(light),
          g_(g),
          view_(view),
          shading_(shading),
          settings_(settings),
          looks_(looks),
          past_(past)
    {
    }

    /// Fills the ring's rays and looks of the pixels in [begin, end).
    void trace(std::size_t begin, std::size_t end, RayRing& ring, Workspace& w) const;

private:
    bool is_traced(std::size_t pixel) const
    {
        return g_.covered(pixel) && shading_.is_traced(pixel) && settings_.takes(pixel);
    }
    void begin_paths(std::size_t pixel, RayRing& ring, Workspace& w) const;
    void trace_packet(const LobePath* paths, int count, Workspace& w) const;
    void shade(const LobePath& path, int lane, const HitSurface& hit, glm::vec3 throughput, Workspace& w) const;
    void shade_plain(const LobePath& path, int lane, const HitSurface& hit, glm::vec3 throughput, RandomStream& random,
                     Workspace& w) const;
    static void add_over(const Ray& shadow_ray, glm::vec3 radiance, glm::vec3& sum, Workspace& w);
    std::size_t look(std::size_t begin, std::size_t end, RayRing& ring, Workspace& w) const;
    glm::vec3& sum_of_plain(const LobePath& path, int lane, const HitSurface& hit, const Workspace& w) const;
    bool is_of_gathered(const LobePath& path, int lane, const Workspace& w) const;
    void add_emission(const LobePath& path, int lane, const HitSurface& hit, glm::vec3 throughput, float cone_width,
                      const Workspace& w) const;
    void add_sky(const LobePath& path, glm::vec3 throughput) const;
    const DirectCells::Light* known_light(const LobePath& path, const SurfacePoint& hit, float distance,
                                          RandomStream& random) const;
    void go_on(const LobePath& path, const SurfacePoint& point, const HitLobes& lobes, glm::vec3 throughput,
               float length, RandomStream& random, Workspace& w) const;

    const RayScene& rays_;
    const HitRadiance& light_;
    const GBuffer& g_;
    const View& view_;
    const Shading& shading_;
    const LobeSettings& settings_;
    const LobeLooks* looks_;
    const PastLobes* past_;
};

}  // namespace rcs
