#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gbuffer/past_view.h"
#include "glossy/traced_lobes.h"

namespace rcs {

/// What an earlier view lets the lobes of this one be spared: most rays of those pixels whose light it knows.
class PastLobes {
public:
    /// @param past  null: nothing is known
    PastLobes(const PastTraced* past, const GBuffer& gbuffer, const Shading& shading, ThreadPool& pool);

    /// How many times fewer rays a pixel takes: 1, 2 or 4.
    int fewer(std::size_t pixel) const { return fewer_.empty() ? 1 : fewer_[pixel]; }
    /// Adds what is known to what the pixels' rays found.
    void add_to(TracedLight& light) const;

private:
    const PastTraced* past_;
    std::vector<std::uint8_t> fewer_;
};

}  // namespace rcs
