#include "util/counters.h"

#include <atomic>
#include <utility>

namespace rcs {
namespace {

std::array<std::atomic<std::uint64_t>, kCounts> totals{};

}  // namespace

constinit thread_local std::array<std::uint64_t, kCounts> detail::counts{};

void flush_counts()
{
    for (std::size_t i = 0; i < kCounts; ++i)
        if (const std::uint64_t more = std::exchange(detail::counts[i], 0); more > 0)
            totals[i].fetch_add(more, std::memory_order_relaxed);
}

std::array<std::uint64_t, kCounts> total_counts()
{
    flush_counts();
    std::array<std::uint64_t, kCounts> result;
    for (std::size_t i = 0; i < kCounts; ++i) result[i] = totals[i].load(std::memory_order_relaxed);
    return result;
}

}  // namespace rcs
