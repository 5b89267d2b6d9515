#include "process/clock.h"

#include <chrono>

namespace rcs::service {
namespace {

template <typename Clock>
std::int64_t milliseconds()
{
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now().time_since_epoch()).count();
}

}  // namespace

Moment read_clocks() { return {milliseconds<std::chrono::system_clock>(), steady_ms()}; }

std::int64_t steady_ms() { return milliseconds<std::chrono::steady_clock>(); }

}  // namespace rcs::service
