#include "cli/render_arguments.h"

#include <algorithm>
#include <array>

#include "cli/outputs.h"
#include "rcs/effects.h"

namespace rcs::service {
namespace {

// What a forecast without a target of its own aims at.
constexpr double kDryRunError = 0.05;

/// Several names for one option, each checked.
void add_effects(CLI::App& command, const std::string& name, std::vector<std::string>& effects, const std::string& help)
{
    command.add_option(name, effects, help)
        ->type_name("EFFECT")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(
            [](const std::string& text) {
                return text == "auto" || text == "all" ? text + " is no effect" : check_text(parse_effects, text);
            },
            "");
}

EffectChoice parse_choice(const RenderArguments& arguments)
{
    for (const std::string& name : arguments.without)
        if (std::find(arguments.with.begin(), arguments.with.end(), name) != arguments.with.end())
            throw Error(ErrorCode::bad_argument, "--without: " + name + " is also given to --with");
    EffectChoice choice = parse_effects(arguments.effects);
    const auto turn = [&](const std::vector<std::string>& names, bool on) {
        for (const std::string& name : names) {
            choice.with.set(find_effect(name), on);
            choice.without.set(find_effect(name), !on);
        }
    };
    turn(arguments.with, true);
    turn(arguments.without, false);
    return choice;
}

void add_motion_arguments(CLI::App& command, RenderArguments& arguments)
{
    command
        .add_option("--motion-time", arguments.motion_time,
                    "Time that the layer motion tells of: how points moved from where they were then [s]; with a sign, "
                    "from --time, such as -0.04 for the frame before")
        ->type_name("SECONDS")
        ->check([](const std::string& text) { return check_text(parse_motion_time, text); }, "");
    command
        .add_option("--motion-camera", arguments.motion_camera,
                    "Camera that the layer motion tells of; default: --camera, as it stands at --motion-time")
        ->type_name("NAME");
}

void check_motion(const RenderArguments& arguments)
{
    const std::vector<std::string>& layers = arguments.output.layers;
    const bool kept = std::find(layers.begin(), layers.end(), "motion") != layers.end();
    const bool told = !arguments.motion_time.empty() || !arguments.motion_camera.empty();
    if (kept && !told) throw Error(ErrorCode::bad_argument, "--layers motion needs --motion-time or --motion-camera");
    if (told && !kept)
        throw Error(ErrorCode::bad_argument, "--motion-time and --motion-camera are for --layers motion, not given");
}

}  // namespace

std::optional<MotionChoice> motion_choice(const RenderArguments& arguments, std::optional<double> time)
{
    if (arguments.motion_time.empty() && arguments.motion_camera.empty()) return std::nullopt;
    MotionChoice choice;
    if (!arguments.motion_time.empty()) {
        const MotionTime other = parse_motion_time(arguments.motion_time);
        if (other.is_relative && !time)
            throw Error(ErrorCode::bad_argument,
                        "--motion-time " + arguments.motion_time + " is relative to --time, which is not given");
        choice.time = other.is_relative ? *time + other.seconds : other.seconds;
    }
    if (!arguments.motion_camera.empty()) {
        choice.camera = camera_choice(arguments.scene);
        choice.camera->name = arguments.motion_camera;
    }
    return choice;
}

std::optional<MotionFrom> motion_from(const RenderArguments& arguments, const Scene& scene)
{
    const auto choice = motion_choice(arguments, arguments.scene.time);
    if (!choice) return std::nullopt;
    return load_motion(*choice, scene, scene_choice(arguments.scene), camera_choice(arguments.scene));
}

RenderOptions final_options(const RenderArguments& arguments)
{
    RenderOptions options = arguments.options;
    const Size size = parse_size(arguments.scene.size);
    options.width = size.width;
    options.height = size.height;
    options.splat = parse_splat_method(arguments.splat);
    if (!arguments.target_error.empty()) {
        options.quality = TargetError{parse_error_target(arguments.target_error)};
    }
    if (!arguments.budget.empty()) {
        options.quality = Budget{parse_budget(arguments.budget)};
    }
    if (options.dry_run && !has_goal(options)) {
        options.quality = TargetError{kDryRunError};
    }
    options.penumbra_samples = std::max(options.penumbra_samples, options.area_samples);
    options.effects = parse_choice(arguments);
    if (arguments.output.files.empty()) {
        options.layers = arguments.output.layers.empty() ? std::nullopt : std::optional(arguments.output.layers);
    } else {
        render_for(parse_outputs(arguments.output, PixelFormat::half_float), options);
    }
    check_motion(arguments);
    validate(options);
    return options;
}

void add_render_arguments(CLI::App& command, RenderArguments& arguments)
{
    RenderOptions& options = arguments.options;
    QualitySettings& quality = settings_of(options);
    add_scene_arguments(command, arguments.scene, {options.width, options.height});
    command
        .add_option(
            "--target-error", arguments.target_error,
            "Mean relative error of indirect light to stop at, such as 5%: records and rays go where it takes them")
        ->type_name("E")
        ->check([](const std::string& text) { return check_text(parse_error_target, text); }, "");
    command
        .add_option("--budget", arguments.budget,
                    "Wall time to spend, such as 20s: records and rays go where they lower the error most")
        ->type_name("T")
        ->check([](const std::string& text) { return check_text(parse_budget, text); }, "");
    command.add_flag("--dry-run", options.dry_run, "Print what which error would cost, and stop");
    add_number(command, "--accuracy", quality.error_tolerance, {0, 1, true},
               "Ward's a, the error that records may be off by; smaller is finer");
    add_number(command, "--rays", quality.rays, {16, 65536}, "Hemisphere rays for each record at first");
    add_number(command, "--noise", quality.noise_target, {0, 1, true},
               "Standard error wanted at a pixel, relative to its light, on wide plain surfaces; where records lie "
               "closer it may be "
               "more. Noisy places take up to 16 times --rays");
    add_number(command, "--bounces", options.bounces, {0, 64}, "Bounces of indirect light; 8 is about all there is");
    add_number(command, "--aa", options.aa, {1, 64}, "Samples a pixel; 1 samples its centre");
    add_number(command, "--overlap", options.overlap, {1, 16},
               "Reach of a record, in times the distance to the next one; more is smoother");
    command
        .add_option("--splat", arguments.splat,
                    "How records reach the image; auto takes quads on a hardware OpenGL, else tiles")
        ->type_name("quads|tiles|auto")
        ->check([](const std::string& text) { return check_text(parse_splat_method, text); }, "")
        ->capture_default_str();
    add_number(command, "--area-samples", options.area_samples, {1, 1024},
               "Shadow rays a pixel towards lamps with area; penumbras take more");
    add_number(command, "--lobe-rays", options.lobe_rays, {1, 1024},
               "Rays a pixel along reflections too sharp for records");
    add_number(command, "--seed", options.seed, {0, kLargestSeed}, "Seed of all random numbers");
    add_output_arguments(command, arguments.output, Renderer::records);
    add_motion_arguments(command, arguments);
    command
        .add_option("--effects", arguments.effects,
                    "What to simulate: auto takes what the view calls for (rcsplat plan says what and why), all takes "
                    "everything, a list what it names and nothing else")
        ->type_name("auto|all|LIST")
        ->check([](const std::string& text) { return check_text(parse_effects, text); }, "")
        ->capture_default_str();
    add_effects(command, "--with", arguments.with, "Simulate this effect in any case; may be given several times");
    add_effects(command, "--without", arguments.without, "Leave this effect out in any case");
    add_report_arguments(command, arguments.report);
    command.get_option("--target-error")->excludes("--budget");
    // A goal chooses these itself.
    for (const char* goal : {"--target-error", "--budget", "--dry-run"})
        for (const char* fixed : {"--accuracy", "--rays", "--noise"}) command.get_option(goal)->excludes(fixed);
    command.get_option("--output")->required(false);
}

}  // namespace rcs::service
