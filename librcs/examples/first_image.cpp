// A first picture: a built-in scene, rendered with default options, tone mapped, written as PNG.
// Usage: first_image [FILE.png]

#include <cstdio>
#include <exception>

#include "rcs/rcs.h"

int main(int argc, char** argv)
{
    const char* file = argc > 1 ? argv[1] : "first_image.png";
    try {
        const rcs::Scene scene = rcs::load_scene("demo:cornell");  // or a .gltf or .glb file
        rcs::ThreadPool pool;
        rcs::GlContext gl;
        const rcs::RayScene rays = rcs::build_ray_scene(scene, pool);

        rcs::RenderOptions options;
        options.width = 256;
        options.height = 256;
        const rcs::Camera& camera = rcs::find_camera(scene, "");
        const rcs::RenderResult result = rcs::render(gl, rays, camera, options, pool);

        const rcs::ToneMapper tone_mapper(rcs::ToneMapOptions{});
        rcs::write_display_image(file, tone_mapper.apply(result.image.layers.at("beauty"), pool));
        std::printf("%s: %zu records, splatted as %s\n", file, result.records.size(),
                    result.stats.splat_method.c_str());
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "first_image: %s\n", e.what());
        return 1;
    }
}
