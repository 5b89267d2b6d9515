#pragma once

#include <string>

#include "rcs/gl_context.h"
#include "rcs/render_options.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// How records are to reach the image.
struct SplatChoice {
    SplatMethod method = SplatMethod::tiles;
    std::string why;

    std::string words() const;
};

/// "quads", "tiles" or "gpu-tiles", as the option has it.
std::string name_of(SplatMethod method);

/// The fastest way. A software GL is not asked: tiles. Else each way splats records of a built-in scene for a moment,
/// and what that took is kept as for choose_gather(), in rcsplat/splat.
/// @param ask  measure even a software GL: for tests
SplatChoice choose_splat(GlContext& gl, ThreadPool& pool, bool ask = false);

}  // namespace rcs
