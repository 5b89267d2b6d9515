#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rcs/thread_pool.h"

namespace rcs {

/// What hot loops count: each thread by itself, summed up when a parallel loop ends.
enum class Count : std::size_t {
    camera_rays,
    punctual_rays,
    area_rays,
    peak_rays,
    highlight_rays,
    hit_lamp_rays,
    hit_sky_rays,
    alpha_tests,
    hit_textures,
    normal_maps,
    gl_bytes,
    count
};
inline constexpr std::size_t kCounts = static_cast<std::size_t>(Count::count);

namespace detail {
// Read and written at a fixed place in the thread's own block: no call, as a shared library would make otherwise.
extern constinit thread_local std::array<std::uint64_t, kCounts> counts __attribute__((tls_model("initial-exec")));
}  // namespace detail

inline void tally(Count what, std::uint64_t more = 1) { detail::counts[static_cast<std::size_t>(what)] += more; }

/// Sums of many threads' counts.
class Counts {
public:
    /// Adds what this thread has counted since it was last asked.
    void take_own();
    std::array<std::uint64_t, kCounts> totals() const;

private:
    std::array<std::atomic<std::uint64_t>, kCounts> totals_{};
};

/// Of all loops of this pool that have ended, and of this thread since its last loop of any pool: what is at work with
/// another pool counts for itself.
std::array<std::uint64_t, kCounts> total_counts(ThreadPool& pool);

}  // namespace rcs
