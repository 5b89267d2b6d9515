#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "hit_light/hit_radiance.h"
#include "rays/shadow_batch.h"
#include "rcs/ray_scene.h"

namespace rcs {

/// A place on a surface, to shoot rays from.
struct SurfaceSample {
    glm::vec3 position;  ///< scene space [m]
    float position_error;
    glm::vec3 geometric_normal, normal;  ///< unit; the second one is the shading normal
};

/// The same without what a sample does not know.
inline SurfacePoint point_of(const SurfaceSample& sample)
{
    SurfacePoint p{};
    p.position = sample.position;
    p.position_error = sample.position_error;
    p.geometric_normal = sample.geometric_normal;
    p.shading_normal = sample.normal;
    return p;
}

/// What one ray of a cell has met.
struct CellHit {
    bool hit = false;
    SurfaceSample surface{};
    glm::vec3 reflectance{
        0.0f};  ///< radiance that comes back times pi, per irradiance; what the ray went through included
};

/// The rays that say where a cell's light comes from, and one thread's working memory for them.
class CellRays {
public:
    static constexpr int kPackets = 4;
    static constexpr int kRays = 64;  ///< of a cell

    CellRays(const RayScene& rays, const HitRadiance& radiance) : rays_(rays), radiance_(radiance)
    {
        reset(packet_.ray);
    }

    /// Shoots cosine-distributed rays, a quarter of them from each of four places.
    /// @param direct  whether to follow the hits' light: else only where they lie is found
    void trace(const std::array<SurfaceSample, kPackets>& places, std::uint64_t key, bool direct);

    const std::array<CellHit, kRays>& hits() const { return hits_; }
    /// Irradiance from what lamps and sky send to the hits, as far as shadow rays let it through [W m^-2].
    glm::vec3 direct_irradiance() const { return direct_irradiance_; }

    std::uint64_t ray_count = 0, shadow_ray_count = 0;  ///< so far

private:
    std::uint32_t aim(const SurfaceSample& place, int first, glm::vec2 shift);
    void shade(const HitSurface& hit, int lane, std::uint64_t key, CellHit& result);

    const RayScene& rays_;
    const HitRadiance& radiance_;
    HitPacket packet_;
    LaneWeights weights_;
    ShadowBatch shadow_;
    std::vector<glm::vec3> lit_;  // what each shadow ray brings if it is free
    std::array<CellHit, kRays> hits_;
    glm::vec3 direct_irradiance_{0.0f};
};

}  // namespace rcs
