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
    std::string target_error, budget;
};

// What a forecast without a target of its own aims at.
constexpr double kDryRunError = 0.05;

/// About what writing the pictures takes, for a budget to leave [s]: measured on two cores (docs/accuracy.md).
double writing_seconds(const std::vector<std::string>& files, const RenderOptions& options)
{
    const double megapixels = 1e-6 * options.width * options.height;
    double seconds = 0.0;
    for (const std::string& file : files) {
        seconds += megapixels * (file.ends_with(".exr") ? 0.75 : 0.25);
    }
    return seconds;
}

std::string to_text(const Forecast& forecast)
{
    std::string text = "\nerror of indirect light   seconds in all\n";
    char line[128];
    for (const Forecast::Point& point : forecast.points) {
        std::snprintf(line, sizeof line, "%20.0f %%   %14.1f\n", 100.0 * point.error, point.seconds);
        text += line;
    }
    std::snprintf(line, sizeof line, "aims at %.1f %%, which takes %.1f s with %d sample%s a pixel\n\n",
                  100.0 * forecast.goal_error, forecast.goal_seconds, forecast.passes, forecast.passes == 1 ? "" : "s");
    return text + line;
}

/// The options as the library takes them: texts parsed, fields that follow from others set.
RenderOptions final_options(const RenderArguments& arguments)
{
    RenderOptions options = arguments.options;
    const Size size = parse_size(arguments.scene.size);
    options.width = size.width;
    options.height = size.height;
    options.splat = parse_splat_method(arguments.splat);
    if (!arguments.target_error.empty()) {
        options.target_error = parse_error_target(arguments.target_error);
    }
    if (!arguments.budget.empty()) {
        options.budget_seconds = parse_budget(arguments.budget);
    }
    if (options.dry_run && options.target_error == 0.0 && options.budget_seconds == 0.0) {
        options.target_error = kDryRunError;
    }
    options.direct.penumbra_samples = std::max(options.direct.penumbra_samples, options.direct.area_samples);
    validate(options);
    return options;
}

void render_scene(const RenderArguments& arguments, const CLI::App& command)
{
    const auto begin = std::chrono::steady_clock::now();
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    RenderOptions options = final_options(arguments);
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

    // What comes before and after render() counts as well.
    const double before = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const double around = before + writing_seconds(arguments.output.files, options);
    if (options.budget_seconds > 0.0) {
        options.budget_seconds = std::max(1e-3, options.budget_seconds - around);
    }
    const auto tell_forecast = [&](Forecast forecast) {
        for (Forecast::Point& point : forecast.points) {
            point.seconds += around;
        }
        forecast.goal_seconds += around;
        report.forecast = forecast;
        if (!arguments.report.quiet && !arguments.report.json) {
            bar.finish();
            std::fputs(to_text(forecast).c_str(), stdout);
            std::fflush(stdout);
        }
    };
    RenderResult result = render(*gl, rays, camera, options, pool, {}, bar.log(), bar.progress(), tell_forecast);
    for (const auto& [stage, seconds] : result.stats.stage_seconds) {
        report.add(stage, seconds);
    }
    if (options.dry_run) {
        bar.finish();
        if (!report.forecast && !arguments.report.quiet && !arguments.report.json)
            std::puts("there is no indirect light to forecast the error of");
        report.render = std::move(result.stats);
        if (!arguments.report.stats_file.empty() || arguments.report.json) {
            deliver(report, arguments.report, begin);
        }
        return;
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
    command.add_option("--target-error", arguments->target_error,
                       "Mean relative error of indirect light to stop at, such as 5%: records and rays go where it takes them")
        ->type_name("E")->check([](const std::string& text) { return check_text(parse_error_target, text); }, "");
    command.add_option("--budget", arguments->budget,
                       "Wall time to spend, such as 20s: records and rays go where they lower the error most")
        ->type_name("T")->check([](const std::string& text) { return check_text(parse_budget, text); }, "");
    command.add_flag("--dry-run", options.dry_run, "Print what which error would cost, and stop");
    add_number(command, "--accuracy", options.records.error_tolerance, {0, 1, true},
               "Ward's a, the error that records may be off by; smaller is finer");
    add_number(command, "--rays", options.records.rays, {16, 65536}, "Hemisphere rays for each record at first");
    add_number(command, "--noise", options.records.noise_target, {0, 1, true},
               "Standard error wanted at a pixel, relative to its light, on wide plain surfaces; where records lie closer it may be "
               "more. Noisy places take up to 16 times --rays");
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
                         {"beauty", "emission", "direct", "indirect", "indirect_error", "irradiance", "albedo", "normal", "depth",
                          "records"});
    add_report_arguments(command, arguments->report);
    command.footer(
        "Example: rcsplat render sponza.glb --camera atrium --size 1000x1000 -o sponza.png -o sponza.exr");
    command.get_option("--output")->required(false);
    // A goal chooses these itself.
    for (const char* goal : {"--target-error", "--budget", "--dry-run"})
        for (const char* fixed : {"--accuracy", "--rays", "--noise"})
            command.get_option(goal)->excludes(fixed);
    command.callback([arguments, &command, &action] {
        if (arguments->output.files.empty() && !arguments->options.dry_run) {
            throw CLI::RequiredError("--output");
        }
        action = [arguments, &command] { render_scene(*arguments, command); };
    });
}

}  // namespace rcs::service
