// A program outside of the project's tree: it needs the installed headers, the library and what both depend on.
#include <cstdio>
#include <exception>

#include <rcs/rcs.h>

int main()
try {
    const rcs::Scene scene = rcs::load_scene("demo:closed-box");
    rcs::ThreadPool pool(2);
    const rcs::RayScene rays = rcs::build_ray_scene(scene, pool);
    const rcs::View view{scene.cameras.at(0), 8, 8};
    const rcs::LayeredImage image = rcs::render_reference(rays, view, {}, pool);
    std::printf("librcs %s, %zu triangles, %zu layers\n", rcs::kVersion, rays.triangle_count(), image.layers.size());
    return image.layers.at("beauty").pixels.at(0) > 0.0f ? 0 : 1;
} catch (const std::exception& e) {
    std::fprintf(stderr, "consumer: %s\n", e.what());
    return 1;
}
