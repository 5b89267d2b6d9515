#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "rcs/api.h"
#include "rcs/effect_plan.h"
#include "rcs/gbuffer.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Indirect irradiance in world space: what every surface that gather rays may hit receives from light that other
/// surfaces have reflected. Refers to the RayScene it was built for, which must outlive it.
class RCS_API LightCache {
public:
    struct Impl;
    /// build_light_cache() makes it.
    explicit LightCache(std::unique_ptr<Impl> impl);
    ~LightCache();
    /// Takes over what the other holds, which is of no use then.
    LightCache(LightCache&&) noexcept;
    /// The same, in place of what this one held.
    LightCache& operator=(LightCache&&) noexcept;

    /// For the library's own use.
    const Impl& impl() const noexcept { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

/// How a light cache is built.
struct LightCacheSettings {
    int bounces = 1;         ///< reflections on the way to a cell's surface, in [1, 64]
    int kept_fewer = 0;      ///< up to so many bounces fewer can be asked for too, in [0, 63]
    int max_cells = 80'000;  ///< that the visible points' rays may find, and again as many that those cells' rays find,
                             ///< in [1, 2^24]; beyond, all of them are taken coarser
    std::uint64_t seed = 1;  ///< of its random numbers
    std::optional<EffectSet> effects = std::nullopt;  ///< of a plan; none: what the scene has, wherever it lies

    /// Whether they make the same cache of the same view.
    bool operator==(const LightCacheSettings&) const = default;
};

/// What a light cache took.
struct LightCacheStats {
    std::uint64_t cells = 0;        ///< that surfaces were cut into
    std::uint64_t links = 0;        ///< rays that found another surface
    std::uint64_t rays = 0;         ///< to find cells and to link them
    std::uint64_t shadow_rays = 0;  ///< of the cells, to lamps
    std::uint64_t bytes = 0;        ///< held while rendering
};

/// Finds the surfaces that the visible points see, cuts them into cells, shoots each cell's rays once and iterates
/// the bounces over what those rays have met: a further bounce costs no further ray.
/// @param view  the view that `gbuffer` was made for
RCS_API LightCache build_light_cache(const RayScene& rays, const GBuffer& gbuffer, const View& view,
                                     const LightCacheSettings& options, ThreadPool& pool, LightCacheStats& stats,
                                     const ProgressFunction& progress = {});

/// @throws Error bad_argument: the field, its value and its range
RCS_API void validate(const LightCacheSettings& options);

}  // namespace rcs
