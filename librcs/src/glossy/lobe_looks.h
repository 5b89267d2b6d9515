#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gbuffer/shading.h"
#include "glossy/lobe_rays.h"
#include "hit_light/hit_radiance.h"
#include "lit_points/gather_guide.h"
#include "rays/shadow_batch.h"

namespace rcs {

/// Light that a shadow ray has yet to find free, and what it adds to.
struct PendingLight {
    glm::vec3* sum;
    glm::vec3 radiance;
};

/// Looks along narrow lobes at lit points, as records look at them (GatherGuide): where a few spots light a room, rays
/// along a lobe mostly miss what it shows of them. Of the light that plain surfaces reflect from lamps and sky, looks
/// bring what is unlikely along the lobe, its rays the rest (LitPart). Any bound gives the same light.
class LobeLooks {
public:
    struct Workspace {
        std::vector<float> importance, lobe;
        std::vector<Look> looks;  ///< one for each shadow ray that look() adds, free or not is not known yet
    };

    /// @param guide  has light
    LobeLooks(const HitRadiance& light, const GatherGuide& guide, const GBuffer& g, const View& view,
              const Shading& shading)
        : light_(light), guide_(guide), g_(g), view_(view), shading_(shading)
    {
    }

    /// Whether some of what these lobes of a surface show comes by looks: not where they are as good as a mirror, or
    /// let light through.
    static bool looks(const Bsdf& bsdf, LobeSet traced);

    /// LitPart::bound where a ray has met a plain surface; 0: nothing is looked at there.
    float bound(const HitPacket& packet, int lane, const HitSurface& hit) const;

    /// Fills a pixel's looks but for what shadow rays find; none where its lobes do not look.
    void look(std::size_t pixel, std::uint64_t key, RayRing& ring, Workspace& w, ShadowBatch& shadow,
              std::vector<PendingLight>& lights) const;

private:
    struct Viewed;
    double weigh_clusters(const Viewed& from, Workspace& w) const;
    bool choose(const Viewed& from, std::size_t cluster, float inverse_chance, RandomStream& random,
                GatherGuide::Choice& choice) const;

    const HitRadiance& light_;
    const GatherGuide& guide_;
    const GBuffer& g_;
    const View& view_;
    const Shading& shading_;
};

}  // namespace rcs
