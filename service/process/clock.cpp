#include "process/clock.h"

#include <chrono>
#include <cstdio>
#include <ctime>

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

double seconds_since(std::chrono::steady_clock::time_point begin)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string utc_text(std::int64_t wall_ms)
{
    const std::time_t seconds = wall_ms / 1000;
    std::tm utc{};
    gmtime_r(&seconds, &utc);
    char text[48];
    const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
    std::snprintf(text + length, sizeof text - length, ".%03dZ", static_cast<int>(wall_ms % 1000));
    return text;
}

std::string local_text(std::int64_t wall_ms)
{
    const std::time_t seconds = wall_ms / 1000;
    std::tm local{};
    localtime_r(&seconds, &local);
    char text[48];
    std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &local);
    return text;
}

}  // namespace rcs::service
