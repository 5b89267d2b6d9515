#include "cli/arguments.h"

#include <filesystem>
#include <numbers>
#include <string_view>
#include <system_error>

#include "cli/describe.h"
#include "wire/limits.h"

namespace rcs::service {
namespace {

constexpr int kMostThreads = 1024;

/// A camera that is none of the scene's.
void add_placed_camera(CLI::App& app, SceneArguments& arguments)
{
    app.option_defaults()->group(option_group::kCamera);
    const auto place = [&](const char* name, std::string& text, const char* help) {
        return app.add_option(name, text, help)->type_name("X,Y,Z")->check(checked_by(parse_place), "");
    };
    CLI::Option* eye = place("--eye", arguments.eye, "A camera that stands there, in place of the scene's [m]");
    CLI::Option* target = place("--target", arguments.target, "What that camera looks at [m]")->needs(eye);
    eye->needs(target)->excludes("--camera");
    place("--up", arguments.up, "Upwards in its picture; default: 0,1,0")->needs(eye);
    add_number(app, "--fov", arguments.fov, {0, 179, true}, "Its vertical field of view [degrees]")->needs(eye);
    app.add_option("--camera-path", arguments.camera_path,
                   "A camera that moves with --time, in place of the scene's: keys in a JSON file (docs/batches.md)")
        ->type_name("FILE")
        ->excludes("--camera")
        ->excludes(eye);
}

/// What the command line says of a camera of its own.
CameraPath path_of(const SceneArguments& arguments)
{
    if (!arguments.camera_path.empty()) return load_camera_path(arguments.camera_path);
    CameraKey key;
    key.eye = parse_place(arguments.eye);
    key.target = parse_place(arguments.target);
    if (!arguments.up.empty()) key.up = parse_place(arguments.up);
    key.yfov = arguments.fov * std::numbers::pi / 180.0;
    const CameraPath path{{key}};
    try {
        validate(path);
    } catch (const Error& e) {
        const std::string_view what = e.what();
        throw Error(e.code(), "--" + std::string(what.substr(what.find('.') + 1)));  // "keys[0].target is ..."
    }
    return path;
}

}  // namespace

void add_scene_arguments(CLI::App& app, SceneArguments& arguments, Size default_size)
{
    app.option_defaults()->group(option_group::kView);
    app.add_option("scene", arguments.scene, "A .gltf or .glb file, or a built-in scene such as demo:atrium")
        ->required()
        ->type_name("SCENE");
    app.add_option("--camera", arguments.camera, "Name of the scene's camera, or its number from 0; default: the first")
        ->type_name("NAME");
    add_placed_camera(app, arguments);
    app.add_option("--lens-shift", arguments.lens_shift,
                   "Moves the picture beside the camera's axis, in its heights, each in [-10, 10]: 0,0.5 puts the "
                   "horizon at the lower edge")
        ->type_name("RIGHT,UP")
        ->check(checked_by(parse_lens_shift), "");
    app.option_defaults()->group(option_group::kView);
    app.add_option("--time", arguments.time, "Pose of the scene's animations at that time [s]; default: the rest pose")
        ->type_name("SECONDS")
        ->check(checked_by(parse_time), "");
    app.add_option("--animation", arguments.animation,
                   "Name or number of the animation that plays (rcsplat plan lists them); default: all of them")
        ->type_name("NAME|all");
    arguments.size = std::to_string(default_size.width) + "x" + std::to_string(default_size.height);
    app.add_option("--size", arguments.size, "Width and height of the picture [px], each in [1, 16384]")
        ->type_name("WxH")
        ->check(checked_by(parse_size), "")
        ->capture_default_str();
    app.add_option("--environment", arguments.environment,
                   "Radiance from outside the scene: a latitude-longitude image (.hdr, .exr, ...), or a constant "
                   "[W m^-2 sr^-1], each >= 0; default: what the scene says, which for a file is none, or 1 if it has "
                   "no light at all")
        ->type_name("scene|none|R,G,B|FILE")
        ->check(checked_by(parse_environment), "")
        ->capture_default_str();
    app.add_option("--asset-root", arguments.asset_root,
                   "Folder beneath which the scene's buffers and textures may lie, for scenes that refer to "
                   "../textures; default: the scene's own")
        ->type_name("DIR");
    add_number(app, "--environment-rotation", arguments.environment_rotation, kRotations,
               "Turns that image about the vertical, counter-clockwise seen from above [degrees]");
    app.option_defaults()->group(option_group::kMachine);
    add_number(app, "--threads", arguments.threads, {0, kMostThreads}, "Worker threads; 0 takes every core");
}

void add_fps(CLI::App& app, double& fps, const std::string& help)
{
    app.add_option_function<std::string>(
           "--fps", [&fps](const std::string& text) { fps = parse_fps(text); },
           help + ", as a number or a fraction such as 24000/1001, in (0, 1e6]")
        ->check(checked_by(parse_fps), "")
        ->type_name("N")
        ->default_str(number_text(fps));
}

SceneChoice scene_choice(const SceneArguments& arguments)
{
    SceneChoice choice{arguments.scene, arguments.time, parse_environment(arguments.environment), arguments.asset_root,
                       arguments.animation};
    std::error_code ignored;
    if (!choice.environment.image.empty() && !std::filesystem::exists(choice.environment.image, ignored))
        throw Error(ErrorCode::not_found, "--environment: file '" + choice.environment.image + "' does not exist");
    if (!choice.asset_root.empty() && !std::filesystem::is_directory(choice.asset_root, ignored))
        throw Error(ErrorCode::not_found, "--asset-root: folder '" + choice.asset_root + "' does not exist");
    choice.environment.rotation_degrees = arguments.environment_rotation;
    return choice;
}

CameraSource::CameraSource(const SceneArguments& arguments) : choice_{arguments.camera, {}, {}}
{
    if (!arguments.eye.empty() || !arguments.camera_path.empty()) path_ = path_of(arguments);
    if (!arguments.lens_shift.empty()) choice_.lens_shift = parse_lens_shift(arguments.lens_shift);
}

CameraChoice CameraSource::at(std::optional<double> time) const
{
    CameraChoice choice = path_ ? rcs::camera_at(*path_, time.value_or(0.0)) : choice_;
    choice.lens_shift = choice_.lens_shift;
    return choice;
}

CameraChoice camera_choice(const SceneArguments& arguments, std::optional<double> time)
{
    return CameraSource(arguments).at(time);
}

void add_output_arguments(CLI::App& app, OutputArguments& arguments, Renderer renderer)
{
    app.option_defaults()->group(option_group::kOutput);
    app.add_option("-o,--output", arguments.files,
                   "File to write, may be given several times: .exr keeps scene-linear values and layers, "
                   ".png and .jpg are tone mapped")
        ->required()
        ->type_name("FILE")
        ->allow_extra_args(false);
    const std::vector<std::string> layers = layer_names(renderer), by_default = default_layer_names(renderer);
    app.add_option("--layers", arguments.layers,
                   "Layers to keep in the EXR, where beauty always is, of: " + listed(layers) +
                       "; default: " + (by_default == layers ? "all" : listed(by_default)))
        ->type_name("A,B,...")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check([layers](const std::string& name) { return check_name("layer", name, layers); }, "");
    app.option_defaults()->group(option_group::kFiles);
    app.add_option("--pixel-format", arguments.pixel_formats,
                   "How values are stored: half or float in EXR, 8 or 16 bits in PNG; may be given for both")
        ->type_name("F")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::IsMember({"half", "float", "8", "16"}).description(""));
    add_display_arguments(app, arguments);
}

void add_display_arguments(CLI::App& app, OutputArguments& arguments)
{
    app.option_defaults()->group(option_group::kOutput);
    app.add_option("--exposure", arguments.exposure,
                   "Exposure of .png and .jpg [EV], in [-64, 64]; auto brings the average to middle grey")
        ->type_name("EV|auto")
        ->check(checked_by(parse_exposure), "")
        ->capture_default_str();
    app.option_defaults()->group(option_group::kFiles);
    app.add_option("--ocio", arguments.tone_map.ocio_config,
                   "OpenColorIO configuration; default: $OCIO, or a built-in one with the ACES 1.0 view")
        ->type_name("FILE");
    app.add_option("--display", arguments.tone_map.display, "Display of that configuration; default: its first")
        ->type_name("NAME");
    app.add_option("--view", arguments.tone_map.view, "View of that display; default: its first")->type_name("NAME");
}

void add_report_arguments(CLI::App& app, ReportArguments& arguments)
{
    app.option_defaults()->group(option_group::kOutput);
    app.add_option("--stats", arguments.stats_file, "Write stage times, counts and memory as JSON")->type_name("FILE");
    app.add_flag("--json", arguments.json, "Print the same JSON on standard output instead of the table");
    app.add_flag("-q,--quiet", arguments.quiet, "Show no progress and no table");
    add_log_level(app, arguments);
}

void add_log_level(CLI::App& app, ReportArguments& arguments)
{
    app.option_defaults()->group(option_group::kMachine);
    app.add_option("--log-level", arguments.log_level, "Least important messages to show")
        ->type_name("debug|info|warning")
        ->check(checked_by(parse_log_level), "")
        ->capture_default_str();
}

}  // namespace rcs::service
