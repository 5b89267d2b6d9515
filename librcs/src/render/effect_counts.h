#pragma once

#include "gbuffer/shading.h"
#include "rcs/render.h"
#include "util/counters.h"

namespace rcs {

/// Brings what hot loops of a pool counted since it was made into EffectCounts.
class EffectTally {
public:
    EffectTally(GlContext& gl, ThreadPool& pool);
    void finish(GlContext& gl, ThreadPool& pool, const std::vector<Record>& records, const LayeredImage& image,
                EffectCounts& counts) const;

private:
    std::array<std::uint64_t, kCounts> before_;
};

inline void note_bytes(const Shading& shading, EffectCounts& counts)
{
    const std::uint64_t bytes = shading.lobes.size() * sizeof(Lobe) +
                                (shading.traced.size() + shading.coverage.size()) * sizeof(float) +
                                shading.through.size() * sizeof(glm::vec3);
    counts.shading_bytes = bytes > counts.shading_bytes ? bytes : counts.shading_bytes;
}

}  // namespace rcs
