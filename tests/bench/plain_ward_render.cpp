/// Renders as irradiance caching was first described, for comparison: records where Ward's harmonic mean distance asks
/// for them at one accuracy, all with as many rays, no limit by gradients or pixels, no more rays where it is noisy.
///
///     plain_ward_render SCENE CAMERA SIZE ACCURACY RAYS OVERLAP OUT.exr
///
/// That neighbours limit each other's radii cannot be switched off; a harmonic mean hardly changes by it. A record
/// reaches one pixel at least, else corners would never be filled. Prints the seconds of the rendering.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "rcs/rcs.h"

namespace {

constexpr float kNoLimit = 1e9f;

rcs::RenderOptions plain_ward(int size, float accuracy, int rays, float overlap)
{
    rcs::RenderOptions options;
    options.width = options.height = size;
    options.aa = 1;
    options.overlap = overlap;
    settings_of(options).error_tolerance = accuracy;
    settings_of(options).rays = rays;
    settings_of(options).refinement = 1;
    options.min_reach = 1.0f / accuracy;
    options.max_reach = kNoLimit;
    options.gradient_limit = kNoLimit;
    return options;
}

void run(char** arguments)
{
    const rcs::RenderOptions options = plain_ward(std::atoi(arguments[3]), std::strtof(arguments[4], nullptr),
                                                  std::atoi(arguments[5]), std::strtof(arguments[6], nullptr));
    rcs::Session session;
    session.show(rcs::load_scene(arguments[1]));
    session.rays(), session.gl();
    const auto start = std::chrono::steady_clock::now();
    const rcs::RenderResult result = rcs::render(session, rcs::find_camera(session.scene(), arguments[2]), options);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    rcs::ImageFileOptions file;
    file.format = rcs::PixelFormat::full_float;
    rcs::write_exr(arguments[7], result.image, file);
    std::printf("{\"seconds\": %.3f, \"records\": %zu, \"rays\": %llu}\n", seconds.count(), result.records.size(),
                static_cast<unsigned long long>(result.stats.records.hemisphere_rays));
}

}  // namespace

int main(int count, char** arguments)
{
    if (count != 8) {
        std::fprintf(stderr, "usage: plain_ward_render SCENE CAMERA SIZE ACCURACY RAYS OVERLAP OUT.exr\n");
        return 2;
    }
    try {
        run(arguments);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "plain_ward_render: %s\n", e.what());
        return 1;
    }
}
