#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "records/watch.h"

namespace rcs {

/// What has changed between the scenes that records know and the one now, and whose rays it reaches.
class Reach {
public:
    /// @param cached  surfaces have light of further bounces: a change may reach everywhere
    Reach(const SceneStates& states, bool cached);

    /// Ways of one record, coordinate by coordinate; working memory, of a thread.
    struct Ways {
        std::array<std::vector<float>, 3> origin, direction;
        std::vector<float> length;
        std::vector<std::uint8_t> ray, met;
        std::size_t count = 0;
    };

    /// A record's rays that may bring another light than they did, bit by number: those that something which has
    /// changed lies in the way of, before what they hit or between that and a lamp.
    std::uint64_t rays(const RecordWatch& watch, Ways& ways) const;

private:
    std::uint32_t now_;
    std::vector<Bounds> where_;                 // of the last scenes, the newest first, a little larger
    std::vector<std::size_t> where_since_{0u};  // of them, those since 0, 1, 2, ... scenes ago
};

}  // namespace rcs
