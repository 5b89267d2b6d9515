#include <string>

#include "rcs/gl_context.h"
#include "session/session_state.h"

namespace rcs {

SplatMethod GraphicsUse::choose_splat(GlContext& gl, ThreadPool& pool, SplatMethod asked, const LogFunction& log)
{
    if (!splats) return SplatMethod::tiles;
    if (asked != SplatMethod::automatic) return asked;
    if (!splat) splat = rcs::choose_splat(gl, pool);
    if (log) log(LogLevel::debug, "auto splats by " + splat->words());
    return splat->method;
}

SplatMethod GraphicsUse::give_up_splats(const GlContext& gl, const Error& why, const LogFunction& log)
{
    splats = false;
    if (log)
        log(LogLevel::warning,
            std::string("the processor splats from here on, as ") + gl.renderer() + " failed: " + why.what());
    return SplatMethod::tiles;
}

}  // namespace rcs
