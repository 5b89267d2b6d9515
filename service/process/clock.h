#pragma once

#include <chrono>
#include <cstdint>
#include <string>

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

/// [s]
double seconds_since(std::chrono::steady_clock::time_point begin);

/// A moment of the wall's clock as text: "2026-11-22T10:31:05.120Z" for logs, "2026-11-22 11:31:05" where we are for
/// people. @param wall_ms  Unix time [ms]
std::string utc_text(std::int64_t wall_ms);
std::string local_text(std::int64_t wall_ms);

}  // namespace rcs::service
