// A walk: frames of a moving camera in one session, which gathers light only where no frame before has looked, written
// as EXR files. Usage: walk [FRAMES [PREFIX]]

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "rcs/rcs.h"

int main(int argc, char** argv)
{
    const int frames = argc > 1 ? std::atoi(argv[1]) : 48;
    const std::string prefix = argc > 2 ? argv[2] : "walk";
    try {
        rcs::Session session({.keep_records = true});
        session.show(rcs::load_scene("demo:cornell"));

        rcs::CameraKey from, to;
        from.eye = {-0.6, 2.7, 10.8}, from.target = {0.0, 2.7, 0.0};
        to.eye = {0.6, 3.0, 9.8}, to.target = {0.0, 2.5, 0.0};
        to.time = 2.0;  // [s]
        const rcs::CameraPath path{{from, to}};

        rcs::RenderOptions options;
        options.width = options.height = 128;
        options.aa = 1;
        for (int frame = 0; frame < frames; ++frame) {
            const rcs::Camera camera = rcs::choose_camera(session.scene(), rcs::camera_at(path, frame / 24.0));
            const rcs::RenderResult result = rcs::render(session, camera, options);
            const std::string file = prefix + "." + std::to_string(frame) + ".exr";
            rcs::write_exr(file, result.image);
            std::printf("%s: %llu records made, %zu in all\n", file.c_str(),
                        static_cast<unsigned long long>(result.stats.records.records), session.records().size());
        }
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "walk: %s\n", e.what());
        return 1;
    }
}
