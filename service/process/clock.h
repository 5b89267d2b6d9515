#pragma once

#include <cstdint>

/// The only room that reads clocks. Deadlines, pauses and durations are counted by the steady one; what is shown is
/// said by the wall's, which may be set an hour back, or to 1970, at any time.
namespace rcs::service {

/// One moment by both clocks.
struct Moment {
    std::int64_t wall_ms = 0;    ///< Unix time [ms]; may jump: for people to read
    std::int64_t steady_ms = 0;  ///< since some start of this machine [ms]; never jumps
};

Moment read_clocks();
std::int64_t steady_ms();

}  // namespace rcs::service
