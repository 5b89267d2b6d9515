// A first picture: a built-in scene, rendered with default options, tone mapped, written as PNG.
// Usage: first_image [FILE.png]

#include <cstdio>
#include <exception>

#include "rcs/rcs.h"

int main(int argc, char** argv)
{
    const char* file = argc > 1 ? argv[1] : "first_image.png";
    try {
        rcs::Session session;
        session.show(rcs::load_scene("demo:cornell"));  // or a .gltf or .glb file

        rcs::RenderOptions options;
        options.width = 256;
        options.height = 256;
        const rcs::RenderResult result = rcs::render(session, rcs::find_camera(session.scene(), ""), options);

        const rcs::ToneMapper tone_mapper(rcs::ToneMapOptions{});
        rcs::write_display_image(file, tone_mapper.apply(result.image.layers.at("beauty"), session.pool()));
        std::printf("%s: %zu records, splatted as %s\n", file, result.records.size(),
                    result.stats.splat_method.c_str());
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "first_image: %s\n", e.what());
        return 1;
    }
}
