#include "commands.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "options.h"
#include "output_files.h"
#include "progress_bar.h"
#include "rcs/rcs.h"
#include "run_support.h"

namespace rcs::service {
namespace {

struct RenderArguments {
    SceneArguments scene;
    OutputArguments output;
    ReportArguments report;
    RenderOptions options;
    std::string splat = "auto";
};

/// The options as the library takes them: texts parsed, fields that follow from others set.
RenderOptions final_options(const RenderArguments& arguments)
{
    RenderOptions options = arguments.options;
    const Size size = parse_size(arguments.scene.size);
    options.width = size.width;
    options.height = size.height;
    options.splat = parse_splat_method(arguments.splat);
    options.direct.penumbra_samples = std::max(options.direct.penumbra_samples, options.direct.area_samples);
    validate(options);
    return options;
}

void render_scene(const RenderArguments& arguments, const CLI::App& command)
{
    const auto begin = std::chrono::steady_clock::now();
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    const RenderOptions options = final_options(arguments);
    const OutputFiles outputs(arguments.output, PixelFormat::half_float, bar.log());
    check_text_path(arguments.report.stats_file);

    ThreadPool pool(arguments.scene.threads);
    RunReport report = begin_report(command, arguments.scene, pool);
    const Scene scene = load(arguments.scene, bar, report);
    const Camera camera = find_camera(scene, arguments.scene.camera);
    report.camera = camera.name;
    const RayScene rays = build_rays(scene, pool, bar, report);
    limit_gl_threads(pool.size());
    const std::unique_ptr<GlContext> gl =
        timed(report, "gl", [&] { return std::make_unique<GlContext>(bar.log()); });

    RenderResult result = render(*gl, rays, camera, options, pool, {}, bar.log(), bar.progress());
    for (const auto& [stage, seconds] : result.stats.stage_seconds) {
        report.add(stage, seconds);
    }
    result.image.metadata["rcs:scene"] = arguments.scene.scene;
    result.image.metadata["rcs:environment"] = arguments.scene.environment;
    outputs.write(result.image, pool, bar.progress(), report);
    bar.finish();
    report.render = std::move(result.stats);
    deliver(report, arguments.report, begin);
}

}  // namespace

void add_render_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand("render", "Renders one view of a scene");
    const auto arguments = std::make_shared<RenderArguments>();
    RenderOptions& options = arguments->options;
    add_scene_arguments(command, arguments->scene, {options.width, options.height});
    add_number(command, "--accuracy", options.records.error_tolerance, {0, 1, true},
               "Ward's a, the error that records may be off by; smaller is finer");
    add_number(command, "--rays", options.records.rays, {16, 65536}, "Hemisphere rays for each record at first");
    add_number(command, "--noise", options.records.noise_target, {0, 1, true},
               "Standard error wanted at a pixel, relative to its light; noisy places take up to 2,048 rays a record");
    add_number(command, "--bounces", options.bounces, {0, 64}, "Bounces of indirect light; 8 is about all there is");
    add_number(command, "--aa", options.aa, {1, 64}, "Samples a pixel; 1 samples its centre");
    add_number(command, "--overlap", options.overlap, {1, 16},
               "Reach of a record, in times the distance to the next one; more is smoother");
    command.add_option("--splat", arguments->splat,
                       "How records reach the image; auto takes quads on a hardware OpenGL, else tiles")
        ->type_name("quads|tiles|auto")
        ->check([](const std::string& text) { return check_text(parse_splat_method, text); }, "")
        ->capture_default_str();
    add_number(command, "--area-samples", options.direct.area_samples, {1, 1024},
               "Shadow rays a pixel towards lamps with area; penumbras take more");
    add_number(command, "--lobe-rays", options.lobe_rays, {1, 1024},
               "Rays a pixel along reflections too sharp for records");
    add_number(command, "--seed", options.seed, {0, kLargestSeed}, "Seed of all random numbers");
    add_output_arguments(command, arguments->output,
                         {"beauty", "emission", "direct", "indirect", "irradiance", "albedo", "normal", "depth",
                          "records"});
    add_report_arguments(command, arguments->report);
    command.footer(
        "Example: rcsplat render sponza.glb --camera atrium --size 1000x1000 -o sponza.png -o sponza.exr");
    command.callback([arguments, &command, &action] {
        action = [arguments, &command] { render_scene(*arguments, command); };
    });
}

}  // namespace rcs::service
