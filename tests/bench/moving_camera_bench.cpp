/// How long pictures take whose camera moves, as the live view makes them, but whole: what a first picture takes, then
/// frames in motion, then one at rest.
///
///     moving_camera_bench SCENE CAMERA SIZE [GATHER [SPLAT [THREADS [FRAMES]]]]
///
/// CAMERA is a name, or - for the first one; SIZE is the side of the picture [px]; GATHER one of auto, cpu, gpu; SPLAT
/// of auto, quads, tiles, gpu-tiles; THREADS 0: all. In each frame the camera comes nearer to what lies in the middle
/// by three thousandths of the way, and turns by half a degree, there and back. Prints a table as Markdown, of
/// milliseconds from the call to the scene-linear picture in memory; reading the scene, its hierarchy and the making of
/// a GL are told apart. What each frame says of its own error is of the picture, holes that were filled from around in
/// it.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/rcs.h"

namespace {

constexpr double kNearer = 0.003, kTurn = 0.5 * 3.14159265358979 / 180.0;  // a frame
constexpr int kSweep = 20;                                                 // frames one way
constexpr double kInMotion = 0.11, kAtRest = 0.05;                         // errors aimed at

double milliseconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values.empty() ? 0.0 : values[values.size() / 2];
}

struct Arguments {
    std::string scene, camera;
    rcs::RenderOptions options;
    int threads = 0, frames = 60;
};

template <typename Method>
Method method_of(const std::string& word, std::initializer_list<std::pair<const char*, Method>> all)
{
    for (const auto& [name, method] : all)
        if (word == name) return method;
    throw rcs::Error(rcs::ErrorCode::bad_argument, "\"" + word + "\" is no such method");
}

Arguments parse(const std::vector<std::string>& words)
{
    using Gather = rcs::GatherMethod;
    using Splat = rcs::SplatMethod;
    const auto word = [&](std::size_t i, const char* otherwise) { return i < words.size() ? words[i] : otherwise; };
    Arguments arguments{words[0],
                        words[1] == "-" ? "" : words[1],
                        {},
                        std::atoi(word(5, "0").c_str()),
                        std::atoi(word(6, "60").c_str())};
    rcs::RenderOptions& options = arguments.options;
    options.width = options.height = std::atoi(words[2].c_str());
    options.aa = 1;
    options.gather = method_of<Gather>(
        word(3, "auto"), {{"auto", Gather::automatic}, {"cpu", Gather::processor}, {"gpu", Gather::device}});
    options.splat = method_of<Splat>(word(4, "auto"), {{"auto", Splat::automatic},
                                                       {"quads", Splat::quads},
                                                       {"tiles", Splat::tiles},
                                                       {"gpu-tiles", Splat::gpu_tiles}});
    if (options.width < 1 || arguments.threads < 0 || arguments.frames < 1)
        throw rcs::Error(rcs::ErrorCode::bad_argument, "SIZE and FRAMES are numbers from 1, THREADS one from 0");
    return arguments;
}

struct Timed {
    double milliseconds, records, error;
    std::uint64_t unserved;
    rcs::RenderResult result;
};

template <typename Work>
Timed timed(const Work& work)
{
    const auto start = std::chrono::steady_clock::now();
    rcs::RenderResult result = work();
    const double all = milliseconds_since(start);
    double records = 0.0;
    for (const auto& [stage, seconds] : result.stats.stage_seconds)
        if (stage == "records") records = 1e3 * seconds;
    const double error = 100.0 * result.stats.errors.image.mean_relative;
    const std::uint64_t unserved = result.stats.unserved_pixels;
    return {all, records, error, unserved, std::move(result)};
}

rcs::Camera moved(const rcs::Camera& from, int frame, double depth)
{
    const int turn = frame % (2 * kSweep), steps = turn < kSweep ? turn : 2 * kSweep - turn;
    rcs::Camera camera = from;
    camera.world_from_view = glm::translate(camera.world_from_view, {0.0, 0.0, -kNearer * steps * depth});
    camera.world_from_view = glm::rotate(camera.world_from_view, kTurn * steps, {0.0, 1.0, 0.0});
    return camera;
}

void print_row(const char* what, const Timed& t, double pixels)
{
    std::printf("| %s | %.0f | %.0f | %.1f | %.2f |\n", what, t.milliseconds, t.records, t.error,
                100.0 * static_cast<double>(t.unserved) / pixels);
}

std::string print_walk(rcs::Session& session, const rcs::Camera& camera, const Arguments& arguments, double depth)
{
    std::vector<double> all, records, errors, unserved;
    std::map<std::string, std::vector<double>> stages;
    for (int frame = 1; frame <= arguments.frames; ++frame) {
        const Timed t = timed([&] {
            return rcs::glance(session, moved(camera, frame, depth), arguments.options, {.gather_seconds = 0.01});
        });
        all.push_back(t.milliseconds), records.push_back(t.records), errors.push_back(t.error);
        unserved.push_back(static_cast<double>(t.unserved));
        for (const auto& [stage, seconds] : t.result.stats.stage_seconds) stages[stage].push_back(1e3 * seconds);
    }
    std::printf("| in motion, median of %d | %.0f | %.0f | %.1f | %.2f |\n", arguments.frames, median(all),
                median(records), median(errors),
                100.0 * median(unserved) / (arguments.options.width * arguments.options.height));
    std::printf("| ... the slowest | %.0f | %.0f | %.1f | |\n", *std::max_element(all.begin(), all.end()),
                *std::max_element(records.begin(), records.end()), *std::max_element(errors.begin(), errors.end()));
    std::string line;
    for (const auto& [stage, times] : stages) {
        char text[64];
        std::snprintf(text, sizeof text, " %s %.0f", stage.c_str(), median(times));
        line += text;
    }
    return "stages of a frame in motion [ms]:" + line;
}

void run(const Arguments& arguments)
{
    rcs::RenderOptions options = arguments.options;
    const double pixels = static_cast<double>(options.width) * options.height;
    const auto begin = std::chrono::steady_clock::now();
    rcs::Session session({.threads = arguments.threads, .keep_records = true});
    session.show(rcs::load_scene(arguments.scene));
    const rcs::Camera camera =
        arguments.camera.empty() ? session.scene().cameras.at(0) : rcs::find_camera(session.scene(), arguments.camera);
    session.rays(), session.gl();
    std::printf("%s, %d x %d, %d threads, %s; scene, hierarchy and GL: %.0f ms\n\n", arguments.scene.c_str(),
                options.width, options.height, session.pool().size(), session.gl().renderer().c_str(),
                milliseconds_since(begin));
    std::printf(
        "| picture | all [ms] | records [ms] | its error, as it says [%%] | filled from around [%%] |\n"
        "| --- | --- | --- | --- | --- |\n");
    const Timed glance = timed([&] { return rcs::glance(session, camera, options, {.gather_seconds = 0.1}); });
    print_row("first glance", glance, pixels);
    const rcs::Image& depths = glance.result.image.layers.at("depth");
    const double middle = depths.pixels[depths.pixels.size() / 2 + static_cast<std::size_t>(options.width / 2)];
    const double depth = middle > 0.0 && middle < 1e9 ? middle : 1.0;
    options.quality = rcs::TargetError{kInMotion};
    print_row("at rest, 11 %", timed([&] { return rcs::render(session, camera, options); }), pixels);
    Arguments walk = arguments;
    walk.options = options;
    const std::string stages = print_walk(session, camera, walk, depth);
    options.quality = rcs::TargetError{kAtRest};
    print_row("at rest, 5 %", timed([&] { return rcs::render(session, moved(camera, 5, depth), options); }), pixels);
    session.forget_light();
    options.quality = rcs::TargetError{kInMotion};
    const Timed alone = timed([&] { return rcs::render(session, camera, options); });
    print_row("from nothing, 11 %", alone, pixels);
    std::printf("\n%s\nrays by %s, splats by %s\n", stages.c_str(), alone.result.stats.gather_method.c_str(),
                alone.result.stats.splat_method.c_str());
}

}  // namespace

int main(int count, char** arguments)
{
    if (count < 4 || count > 8) {
        std::fprintf(stderr, "usage: moving_camera_bench SCENE CAMERA SIZE [GATHER [SPLAT [THREADS [FRAMES]]]]\n");
        return 2;
    }
    try {
        run(parse({arguments + 1, arguments + count}));
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "moving_camera_bench: %s\n", e.what());
        return 1;
    }
}
