#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "rcs/gl_context.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// How fast several ways to do the same are on this machine.
struct MeasuredSpeeds {
    std::vector<double> speeds;
    bool were_kept = false;

    /// "measured before" or "measured now".
    const char* when() const { return were_kept ? "measured before" : "measured now"; }
};

/// The speeds that the user's cache folder ($XDG_CACHE_HOME or ~/.cache) keeps in rcsplat/NAME for this device, driver,
/// number of threads and version; else measures them, and keeps them there.
/// @param count  of speeds, each > 0
/// @throws what `measure` throws
MeasuredSpeeds speeds_of(const std::string& name, const GlContext& gl, const ThreadPool& pool, std::size_t count,
                         const std::function<std::vector<double>()>& measure);

}  // namespace rcs
