#pragma once

#include <chrono>
#include <string>

#include "rcs/error.h"
#include "rcs/render.h"

namespace rcs {

/// Does the work of a stage and adds its wall time to the statistics.
/// @throws Error cancelled, if that is what `progress` says before it begins
template <typename Work>
auto timed(RenderStats& stats, const ProgressFunction& progress, const char* stage, const Work& work)
{
    if (progress && !progress(stage, 0.0f))
        throw Error(ErrorCode::cancelled, std::string("cancelled before stage ") + stage);
    struct Stop {
        RenderStats& stats;
        const char* stage;
        std::chrono::steady_clock::time_point start;
        ~Stop() { stats.add(stage, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()); }
    };
    const Stop stop{stats, stage, std::chrono::steady_clock::now()};
    return work();
}

}  // namespace rcs
