#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "light/lights.h"

namespace rcs {

/// A lamp to look at, and how many lamps it stands for. Lamps are numbered: punctual ones, then triangles.
struct LampCandidate {
    std::uint32_t lamp;
    float multiplicity;
};

/// Which lamps of a scene are worth a look at a point: all of them while they are few, else as many drawn
/// by power, each weighted by one over its chance, so that sums over candidates stay unbiased.
class LampCandidates {
public:
    /// @param most  at most so many candidates, > 0   @param with_punctual  or the triangles alone
    LampCandidates(const Lights& lights, std::size_t most, bool with_punctual);

    /// Whether there are more lamps than candidates, so that draw() needs a random number.
    bool draws() const { return !power_cdf_.empty(); }

    /// @param offset  in [0, 1): of the systematic sample   @param candidates  room for `most`
    /// @return how many there are
    std::size_t draw(float offset, std::span<LampCandidate> candidates) const;

private:
    std::uint32_t first_ = 0;
    std::uint32_t count_ = 0;
    std::size_t most_;
    std::vector<double> power_cdf_;  // only where there are more than `most`
};

}  // namespace rcs
