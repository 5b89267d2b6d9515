#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

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

/// Adds this thread's counts to those of the process. ThreadPool does it for its threads.
void flush_counts();

/// Of the process since its start: of all loops that have ended, and of this thread.
std::array<std::uint64_t, kCounts> total_counts();

}  // namespace rcs
