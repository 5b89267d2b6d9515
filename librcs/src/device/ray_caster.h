#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rays/packet.h"
#include "rays/shadow_batch.h"
#include "rcs/gl_context.h"
#include "rcs/log.h"
#include "rcs/ray_scene.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A packet to be traced: its active lanes, as intersect() takes it.
struct AimedPacket {
    HitPacket* packet;
    LaneWeights* weights;
    std::uint32_t active;
};

/// Where rays were traced.
struct CasterCounts {
    std::uint64_t rays = 0;   ///< on the device
    std::uint64_t asked = 0;  ///< of those, again by the processor: they met surfaces that may let them through
    std::uint64_t dispatches = 0;
};

/// Of the device's memory.
inline constexpr std::size_t kAllOfIt = std::numeric_limits<std::size_t>::max();

/// Rays through a scene, in waves, traced by compute shaders: what intersect() and ShadowBatch::trace() find, to
/// rounding. What a surface that is not opaque does to a ray is left to the processor. Where the device fails, the
/// processor does the rest, and one warning says so. Belongs to the thread of its GL.
class RayCaster {
public:
    /// Brings the scene's surfaces to the device.
    /// @param gl, rays  must outlive it; lamps may change   @param most_bytes  of the device's memory to take
    /// @throws Error out_of_memory, unsupported, gl_unavailable: the device cannot do it, and why
    RayCaster(GlContext& gl, const RayScene& rays, std::size_t most_bytes = kAllOfIt, LogFunction log = {});
    ~RayCaster();
    RayCaster(const RayCaster&) = delete;
    RayCaster& operator=(const RayCaster&) = delete;

    /// False once the device has failed.
    bool works() const noexcept;
    /// So many rays are worth collecting.
    std::size_t wave() const noexcept;

    void intersect(std::span<const AimedPacket> packets, ThreadPool& pool);
    void trace(std::span<ShadowBatch* const> batches, ThreadPool& pool);

    const CasterCounts& counts() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rcs
