#pragma once

#include <string>

#include "rcs/gl_context.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// What is to trace the rays of gathers.
struct GatherChoice {
    bool on_device = false;
    std::string why;

    std::string words() const { return (on_device ? "graphics card: " : "processor: ") + why; }
};

/// The faster of processor and device. A software GL is not asked. Else both gather records in a built-in scene for a
/// moment, and what they took is kept in the user's cache folder ($XDG_CACHE_HOME or ~/.cache, rcsplat/gathers) for
/// this device, driver, number of threads and version.
/// @param ask  measure even a software GL: for tests
GatherChoice choose_gather(GlContext& gl, ThreadPool& pool, bool ask = false);

}  // namespace rcs
