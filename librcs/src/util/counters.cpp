#include "util/counters.h"

#include <utility>

namespace rcs {

constinit thread_local std::array<std::uint64_t, kCounts> detail::counts{};

void Counts::take_own()
{
    for (std::size_t i = 0; i < kCounts; ++i)
        if (const std::uint64_t more = std::exchange(detail::counts[i], 0); more > 0)
            totals_[i].fetch_add(more, std::memory_order_relaxed);
}

std::array<std::uint64_t, kCounts> Counts::totals() const
{
    std::array<std::uint64_t, kCounts> result;
    for (std::size_t i = 0; i < kCounts; ++i) result[i] = totals_[i].load(std::memory_order_relaxed);
    return result;
}

}  // namespace rcs
