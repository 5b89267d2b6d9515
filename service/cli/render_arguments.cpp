#include "cli/render_arguments.h"

#include <algorithm>

#include "cli/describe.h"
#include "cli/outputs.h"
#include "rcs/effects.h"

namespace rcs::service {
namespace {

// What a forecast without a target of its own aims at.
constexpr double kDryRunError = 0.05;

const std::size_t kSettings = Quality(QualitySettings{}).index();

/// What --effects says, but for the effects that --with and --without name.
EffectChoice choose_effects(const std::string& effects, const EffectChoice& named)
{
    EffectChoice choice = parse_effects(effects);
    for (std::size_t i = 0; i < kEffects; ++i) {
        const auto effect = static_cast<Effect>(i);
        if (!named.with.has(effect) && !named.without.has(effect)) continue;
        choice.with.set(effect, named.with.has(effect));
        choice.without.set(effect, named.without.has(effect));
    }
    return choice;
}

void add_motion_arguments(CLI::App& command, RenderArguments& arguments)
{
    command.option_defaults()->group(option_group::kFiles);
    command
        .add_option("--motion-time", arguments.motion_time,
                    "Time that the layer motion tells of: how points moved from where they were then [s]; with a sign, "
                    "from --time, such as -0.04 for the frame before")
        ->type_name("SECONDS")
        ->check(checked_by(parse_motion_time), "");
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
    if (!arguments.scene.camera_path.empty()) choice.camera = camera_choice(arguments.scene, choice.time);
    if (!arguments.motion_camera.empty()) {
        choice.camera = camera_choice(arguments.scene, time);
        choice.camera->name = arguments.motion_camera;
        choice.camera->given.reset();
    }
    return choice;
}

std::optional<MotionFrom> motion_from(const RenderArguments& arguments, const Scene& scene)
{
    const auto choice = motion_choice(arguments, arguments.scene.time);
    if (!choice) return std::nullopt;
    return load_motion(*choice, scene, scene_choice(arguments.scene),
                       camera_choice(arguments.scene, arguments.scene.time));
}

RenderOptions final_options(const RenderArguments& arguments)
{
    RenderOptions options = read_options(arguments.options, {});
    const Size size = parse_size(arguments.scene.size);
    options.width = size.width;
    options.height = size.height;
    if (arguments.dry_run && !has_goal(options)) {
        options.quality = TargetError{kDryRunError};
    }
    validate_named(options);
    options.effects = choose_effects(arguments.effects, options.effects);
    if (arguments.output.files.empty()) {
        options.layers = arguments.output.layers.empty() ? std::nullopt : std::optional(arguments.output.layers);
    } else {
        render_for(parse_outputs(arguments.output, PixelFormat::half_float), options);
    }
    check_motion(arguments);
    return options;
}

void add_render_arguments(CLI::App& command, RenderArguments& arguments)
{
    const RenderOptions defaults;
    add_scene_arguments(command, arguments.scene, {defaults.width, defaults.height});
    command.option_defaults()->group(option_group::kQuality);
    command.add_flag("--dry-run", arguments.dry_run, "Print what which error would cost, and stop");
    add_table_options(command, defaults, arguments.options);
    command.option_defaults()->group(option_group::kEffects);
    command
        .add_option("--effects", arguments.effects,
                    "What to simulate: auto takes what the view calls for (rcsplat plan says what and why), all takes "
                    "everything, a list what it names and nothing else; --with and --without come after it")
        ->type_name("auto|all|LIST")
        ->check(checked_by(parse_effects), "")
        ->capture_default_str();
    add_output_arguments(command, arguments.output, Renderer::records);
    add_motion_arguments(command, arguments);
    add_report_arguments(command, arguments.report);
    // A forecast chooses the settings itself.
    for (const OptionInfo& option : option_table())
        if (kSettings == quality_of(option)) command.get_option("--dry-run")->excludes(std::string(option.name));
    command.get_option("--output")->required(false);
}

}  // namespace rcs::service
