// Group F: frames of an animation, as far as there is one: posed scenes, and records handed from frame to frame.
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "rcs/error.h"
#include "rcs/ray_scene.h"
#include "rcs/record_file.h"
#include "rcs/reference.h"
#include "stability/case_run.h"
#include "stability/metamorphic.h"
#include "stability/scenes.h"

namespace rcs::stability {
namespace {

void static_frames(CaseRun& run)
{
    const Scene scene = furnished_room();
    const RenderOptions options = small_options(64);
    const RenderResult first = run.render(scene, options, "frame 1");
    std::vector<Record> kept = first.records;
    for (int frame = 2; frame <= 4; ++frame) {
        const RenderResult next =
            run.render(scene, scene.cameras[0], options, "frame " + std::to_string(frame), run.pool(), kept);
        std::string layer;
        run.figure(same_bits(next.image, first.image, layer) ? 0.0 : 1.0,
                   "frames with other bits" + (layer.empty() ? "" : ", in layer " + layer));
        run.require(next.stats.records.records == 0, "frame " + std::to_string(frame) + " gathers " +
                                                         std::to_string(next.stats.records.records) + " records");
        kept = next.records;
    }
}

/// What reading the file says; nothing if it was taken.
std::string complaint(const std::string& path, const RecordKey& key)
{
    try {
        read_records(path, key);
        return {};
    } catch (const Error& e) {
        return e.what();
    }
}

void records_in_a_file(CaseRun& run)
{
    const Scene scene = furnished_room();
    const RenderOptions options = small_options(64);
    const RenderResult first = run.render(scene, options, "frame 1");
    const std::string path = run.folder() + "/shot.records";
    const RecordKey key = record_key(scene, options);
    write_records(path, key, first.records);
    const RenderResult next =
        run.render(scene, scene.cameras[0], options, "frame 2", run.pool(), read_records(path, key));
    std::string layer;
    run.figure(same_bits(next.image, first.image, layer) ? 0.0 : 1.0,
               "frames with other bits" + (layer.empty() ? "" : ", in layer " + layer));
    run.require(next.stats.records.records == 0,
                "frame 2 gathers " + std::to_string(next.stats.records.records) + " records");

    Scene brighter = scene;
    brighter.lights.push_back(point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
    RenderOptions finer = options;
    settings_of(finer).error_tolerance *= 0.5f;
    run.require(!complaint(path, record_key(brighter, options)).empty(), "records of another light are taken");
    run.require(!complaint(path, record_key(scene, finer)).empty(), "records of another accuracy are taken");
    std::ifstream file(path, std::ios::binary);
    const std::string whole{std::istreambuf_iterator<char>(file), {}};
    std::mt19937 engine(1);
    for (int n = 0; n < 200; ++n) {
        std::string damaged = whole;
        const std::size_t at = std::uniform_int_distribution<std::size_t>(0, whole.size() - 1)(engine);
        if (n % 2 == 0)
            damaged.resize(at);
        else
            damaged[at] = static_cast<char>(damaged[at] ^ 1 << n / 2 % 8);
        std::ofstream(path, std::ios::binary) << damaged;
        const std::string words = complaint(path, key);
        run.require(words.find("shot.records") != std::string::npos,
                    "damage at byte " + std::to_string(at) + ": '" + words + "'");
    }
}

/// Notes how much farther from the path tracer a frame is with the records of before than by itself.
void compare_with_fresh(CaseRun& run, const Scene& scene, const RenderOptions& options, const LayeredImage& shot,
                        const std::string& name)
{
    const LayeredImage alone = run.render(scene, options, name + " by itself").image;
    const RayScene rays = build_ray_scene(scene, run.pool());
    ReferenceOptions reference;
    reference.samples = 512;
    const View view = view_of(scene.cameras[0], options.width, options.height);
    const LayeredImage truth = render_reference(rays, view, reference, run.pool());
    const double error = mean_difference(alone, truth, "indirect");
    run.figure(mean_difference(shot, truth, "indirect") / error,
               "error of " + name + " against the path tracer, over that of the frame by itself");
    run.note(name + " by itself " + text_of(error));
}

void moving_camera(CaseRun& run)
{
    Scene scene = furnished_room();
    const RenderOptions options = small_options(64);
    std::vector<Record> kept;
    for (int frame = 0; frame < 5; ++frame) {
        scene.cameras = {
            look_at_camera("camera", {1.2 - 0.1 * frame, 1.6, 1.8 - 0.05 * frame}, {-0.3, 0.8, -0.5}, 1.1)};
        const std::string name = "frame " + std::to_string(frame);
        RenderResult shot = run.render(scene, scene.cameras[0], options, name, run.pool(), std::move(kept));
        if (frame == 2 || frame == 4) compare_with_fresh(run, scene, options, shot.image, name);
        kept = std::move(shot.records);
    }
    const RenderOptions large = small_options(96);
    const RenderResult coarse = run.render(scene, small_options(8), "small picture");
    const RenderResult shot = run.render(scene, scene.cameras[0], large, "large picture", run.pool(), coarse.records);
    compare_with_fresh(run, scene, large, shot.image, "a picture 12 times as large");
}

/// The room with its block somewhere else, and a lamp that is on or off.
Scene frame_of(double time)
{
    Scene scene = furnished_room();
    scene.instances[1].world_from_object = glm::translate(glm::dmat4(1.0), glm::dvec3(0.8 * time, 0.0, 0.0));
    if (time > 0.5) scene.lights.push_back(point_light({-1.5, 2.0, 1.0}, {3.0f, 1.0f, 0.5f}));
    return scene;
}

void frames_know_nothing_of_each_other(CaseRun& run)
{
    const RenderOptions options = small_options(64);
    for (const double time : {0.0, 0.4, 1.0}) {
        const LayeredImage alone = run.render(frame_of(time), options, "alone").image;
        LayeredImage after;
        for (const double earlier : {1.0, 0.0, time})
            after = run.render(frame_of(earlier), options, "after others").image;
        std::string layer;
        run.figure(same_bits(alone, after, layer) ? 0.0 : 1.0,
                   "frames with other bits" + (layer.empty() ? "" : ", in layer " + layer));
    }
    const LayeredImage dark = run.render(frame_of(0.4), options, "lamp off").image,
                       lit = run.render(frame_of(1.0), options, "lamp on").image;
    run.require(mean_difference(lit, dark, "direct") > 0.1, "the frames do not differ at all");
}

}  // namespace

std::vector<SuiteCase> time_cases()
{
    const std::string group = "time";
    return {
        {{"F1", group, "Four frames of a still scene that hand their records on",
          "records gathered again, pictures that drift", "same bits, records gathered once", 0.0, "nothing changes",
          true},
         static_frames},
        {{"F1b", group, "Records saved to a file; the file damaged, or of another scene or accuracy",
          "old light, garbage taken for records", "same bits, nothing gathered; else one error that names the file",
          0.0, "what is read is what was written", true},
         records_in_a_file},
        {{"F2", group,
          "A camera that moves through a still scene with its records; a larger picture with those of a small one",
          "records that serve another view wrongly", "each frame as near to the path tracer as the frame by itself",
          1.6,
          "1 + 3 standard errors of the ratio of two mean absolute errors: 270 records, of which 9 that overlap err "
          "together, make 30 independent ones",
          true},
         moving_camera},
        {{"F3", group, "An object moves and a lamp switches on: frames in any order (F3 to F5)",
          "ghosts and old light from the frame before", "each frame has the bits it has alone", 0.0,
          "without handed records frames share nothing", true},
         frames_know_nothing_of_each_other},
    };
}

}  // namespace rcs::stability
