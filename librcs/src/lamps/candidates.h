#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lamps/light_tree.h"
#include "lamps/lights.h"

namespace rcs {

/// Which lamps of a scene are worth a look at a point: all of them while they are few. Of many triangles, as many
/// drawn from a tree of them by what they send to the point; of many punctual lamps, as many drawn by power. Each is
/// weighted by one over its chance, so that sums over candidates stay unbiased.
/// Lamps are numbered: punctual ones, then triangles.
class LampCandidates {
public:
    /// @param most  at most so many candidates, > 1   @param with_punctual  or the triangles alone
    LampCandidates(const Lights& lights, std::size_t most, bool with_punctual);

    /// Whether there are more lamps than candidates, so that draw() needs a random number.
    bool draws() const { return count_ > most_; }

    /// @param normal  of the surface, unit   @param offset  in [0, 1)   @param candidates  room for `most`
    /// @return how many there are
    std::size_t draw(glm::vec3 point, glm::vec3 normal, float offset, std::span<LampCandidate> candidates) const;

private:
    std::size_t draw_punctual(float offset, std::size_t room, std::span<LampCandidate> candidates) const;

    std::uint32_t first_ = 0, count_ = 0, punctual_ = 0;
    std::size_t most_;
    std::vector<double> power_cdf_;  // of the punctual lamps
    std::shared_ptr<const LightTree> tree_;
};

}  // namespace rcs
