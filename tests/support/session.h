#pragma once

#include <utility>
#include <vector>

#include "rcs/render.h"

namespace rcs::test {

/// The GL of a test program: made once, as a program would.
inline GlContext& shared_gl()
{
    static GlContext gl;
    return gl;
}

/// Options by default, but for the picture's size [px] and its samples a pixel.
inline RenderOptions options_of_size(int width, int height, int aa)
{
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.aa = aa;
    return options;
}

/// Renders a view in a session of its own. @param cache  records that it begins with
inline RenderResult render_view(const Scene& scene, const Camera& camera, const RenderOptions& options, int threads = 2,
                                std::vector<Record> cache = {}, const RenderHooks& hooks = {})
{
    ThreadPool pool(threads);
    Session session(shared_gl(), pool);
    session.show(scene);
    if (!cache.empty()) session.begin_with(std::move(cache));
    return render(session, camera, options, hooks);
}

/// The scene's first camera.
inline RenderResult render_first(const Scene& scene, const RenderOptions& options, int threads = 2,
                                 std::vector<Record> cache = {}, const RenderHooks& hooks = {})
{
    return render_view(scene, scene.cameras.at(0), options, threads, std::move(cache), hooks);
}

}  // namespace rcs::test
