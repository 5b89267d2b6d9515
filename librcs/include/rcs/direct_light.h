#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/api.h"
#include "rcs/effect_plan.h"
#include "rcs/gbuffer.h"
#include "rcs/ray_scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// Lamps whose light records gather, as they gather that of the sky (method.md).
struct GatheredLamps;

/// How direct light is sampled.
struct DirectSettings {
    int area_samples = 16;  ///< shadow rays per pixel towards lamps with area where visibility is uniform, in [1, 1024]
    int penumbra_samples = 64;  ///< the same where it is mixed, in [area_samples, 65536]
    int lamp_picks = 0;  ///< 0: each triangle that matters gets shadow rays of its own; else so many of them, picked by
                         ///< what they would send, stand for all, and penumbras get no more: cheap and
                         ///< noisy. In [0, 1024]
    bool error = false;  ///< pixels sampled twice, a few of them, tell the others' standard errors
    std::optional<std::uint64_t> checked = std::nullopt;  ///< of which pixels are sampled twice more, for all passes to
                                                          ///< check the same ones; none: only for `error`
    bool together = false;   ///< where lamps are drawn, pixels beside each other put together what they found
    std::uint64_t seed = 1;  ///< of shadow rays
    std::optional<EffectSet> effects = std::nullopt;  ///< of a plan; none: what the scene has, wherever it lies
    const GatheredLamps* gathered = nullptr;  ///< the diffuse part of their light is left to records; null: none
};

/// @throws Error bad_argument: the field, its value and its range
RCS_API void validate(const DirectSettings& options);

/// Direct irradiance of the scene's lamps at every visible point. The sky is not a lamp: its light
/// arrives through the records.
/// @param shadow_rays  is increased by the number of shadow rays shot
/// @return one RGB irradiance [W m^-2] per pixel; 0 where nothing is seen
RCS_API std::vector<glm::vec3> direct_irradiance(const RayScene& rays, const GBuffer& gbuffer,
                                                 const DirectSettings& options, ThreadPool& pool,
                                                 std::uint64_t& shadow_rays);

}  // namespace rcs
