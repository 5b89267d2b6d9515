#include "options.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <system_error>
#include <type_traits>

#include "rcs/camera.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

constexpr int kLargestSide = 16384;  // as RenderOptions::width
constexpr int kMostThreads = 1024;

std::string number_text(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.12g", value);
    return text;
}

std::string range_text(Range range)
{
    return (range.open ? "(" : "[") + number_text(range.least) + ", " + number_text(range.most) + "]";
}

/// Reads one number and what follows it. @return false if there is none
bool take_number(const char*& cursor, double& value)
{
    char* end = nullptr;
    value = std::strtod(cursor, &end);
    if (end == cursor || !std::isfinite(value)) {
        return false;
    }
    cursor = end;
    return true;
}

template <typename Value>
Value look_up(const std::map<std::string, Value>& choices, const std::string& text)
{
    const auto found = choices.find(text);
    if (found != choices.end()) {
        return found->second;
    }
    std::string names;
    for (const auto& [name, value] : choices) {
        names.append(names.empty() ? "" : ", ").append(name);
    }
    throw Error(ErrorCode::bad_argument, text + " is not one of " + names);
}

/// The same as a check of an option.
template <typename Parse>
std::function<std::string(const std::string&)> checked_by(Parse parse)
{
    return [parse](const std::string& text) { return check_text(parse, text); };
}

}  // namespace

template <typename Number>
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& value, Range range, const std::string& help)
{
    CLI::Option* option = app.add_option(name, value, help + ", in " + range_text(range));
    const auto in_range = [range](const std::string& text) {
        const char* cursor = text.c_str();
        double number = 0.0;
        if (take_number(cursor, number) && *cursor == '\0' && number <= range.most &&
            (range.open ? number > range.least : number >= range.least) &&
            (!std::is_integral_v<Number> || number == std::floor(number))) {
            return std::string();
        }
        return text + (std::is_integral_v<Number> ? " is no whole number in " : " is no number in ") +
               range_text(range);
    };
    return option->check(in_range, "")->type_name("N")->capture_default_str();
}

template CLI::Option* add_number(CLI::App&, const std::string&, int&, Range, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, float&, Range, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, double&, Range, const std::string&);
template CLI::Option* add_number(CLI::App&, const std::string&, std::uint64_t&, Range, const std::string&);

void add_scene_arguments(CLI::App& app, SceneArguments& arguments, Size default_size)
{
    app.add_option("scene", arguments.scene, "A .gltf or .glb file, or a built-in scene such as demo:atrium")
        ->required()
        ->type_name("SCENE");
    app.add_option("--camera", arguments.camera, "Name of the scene's camera, or its number from 0; default: the first")
        ->type_name("NAME");
    app.add_option("--lens-shift", arguments.lens_shift,
                   "Moves the picture beside the camera's axis, in its heights, each in [-10, 10]: 0,0.5 puts the "
                   "horizon at the lower edge")
        ->type_name("RIGHT,UP")
        ->check(checked_by(parse_lens_shift), "");
    app.add_option("--time", arguments.time, "Pose of the scene's animations at that time [s]; default: the rest pose")
        ->type_name("SECONDS")
        ->check(checked_by(parse_time), "");
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
    add_number(app, "--environment-rotation", arguments.environment_rotation, {-360.0, 360.0},
               "Turns that image about the vertical, counter-clockwise seen from above [degrees]");
    add_number(app, "--threads", arguments.threads, {0, kMostThreads}, "Worker threads; 0 takes every core");
}

void add_output_arguments(CLI::App& app, OutputArguments& arguments, const std::vector<std::string>& layers)
{
    app.add_option("-o,--output", arguments.files,
                   "File to write, may be given several times: .exr keeps scene-linear values and layers, "
                   ".png and .jpg are tone mapped")
        ->required()
        ->type_name("FILE")
        ->allow_extra_args(false);
    std::string names;
    for (const std::string& layer : layers) {
        names.append(names.empty() ? "" : ", ").append(layer);
    }
    app.add_option("--layers", arguments.layers,
                   "Layers to keep in the EXR, where beauty always is, of: " + names + "; default: all")
        ->type_name("A,B,...")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::IsMember(layers).description(""));
    app.add_option("--pixel-format", arguments.pixel_formats,
                   "How values are stored: half or float in EXR, 8 or 16 bits in PNG; may be given for both")
        ->type_name("F")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::IsMember({"half", "float", "8", "16"}).description(""));
    app.add_option("--exposure", arguments.exposure,
                   "Exposure of .png and .jpg [EV], in [-64, 64]; auto brings the average to middle grey")
        ->type_name("EV|auto")
        ->check(checked_by(parse_exposure), "")
        ->capture_default_str();
    app.add_option("--ocio", arguments.tone_map.ocio_config,
                   "OpenColorIO configuration; default: $OCIO, or a built-in one with the ACES 1.0 view")
        ->type_name("FILE");
    app.add_option("--display", arguments.tone_map.display, "Display of that configuration; default: its first")
        ->type_name("NAME");
    app.add_option("--view", arguments.tone_map.view, "View of that display; default: its first")->type_name("NAME");
}

void add_report_arguments(CLI::App& app, ReportArguments& arguments)
{
    app.add_option("--stats", arguments.stats_file, "Write stage times, counts and memory as JSON")->type_name("FILE");
    app.add_flag("--json", arguments.json, "Print the same JSON on standard output instead of the table");
    app.add_flag("-q,--quiet", arguments.quiet, "Show no progress and no table");
    app.add_option("--log-level", arguments.log_level, "Least important messages to show")
        ->type_name("debug|info|warning")
        ->check(checked_by(parse_log_level), "")
        ->capture_default_str();
}

Size parse_size(const std::string& text)
{
    const auto side = [](const std::string& digits) {
        // 5 digits hold the largest side; more could overflow
        const bool plain =
            !digits.empty() && digits.size() <= 5 && digits.find_first_not_of("0123456789") == digits.npos;
        return plain ? std::stoi(digits) : 0;
    };
    const std::size_t cross = std::min(text.find('x'), text.size());
    const Size size{side(text.substr(0, cross)), side(text.substr(std::min(cross + 1, text.size())))};
    if (size.width < 1 || size.width > kLargestSide || size.height < 1 || size.height > kLargestSide) {
        throw Error(ErrorCode::bad_argument,
                    text + " is no WIDTHxHEIGHT with each in [1, " + std::to_string(kLargestSide) + "]");
    }
    return size;
}

double parse_time(const std::string& text)
{
    const char* cursor = text.c_str();
    double value = 0.0;
    if (!take_number(cursor, value) || *cursor != '\0') {
        throw Error(ErrorCode::bad_argument, text + " is no number of seconds");
    }
    return value;
}

glm::dvec2 parse_lens_shift(const std::string& text)
{
    const char* cursor = text.c_str();
    glm::dvec2 shift(0.0);
    if (!take_number(cursor, shift.x) || *cursor++ != ',' || !take_number(cursor, shift.y) || *cursor != '\0' ||
        !(std::abs(shift.x) <= kMostLensShift && std::abs(shift.y) <= kMostLensShift)) {
        throw Error(ErrorCode::bad_argument,
                    text + " is not RIGHT,UP with two values in [-10, 10], in heights of the picture");
    }
    return shift;
}

double parse_error_target(const std::string& text)
{
    const char* cursor = text.c_str();
    double value = 0.0;
    const bool number = take_number(cursor, value);
    const bool percent = number && *cursor == '%';
    value *= percent ? 0.01 : 1.0;
    if (!number || cursor[percent ? 1 : 0] != '\0' || !(value > 0.0 && value <= 1.0)) {
        throw Error(ErrorCode::bad_argument, text + " is no relative error in (0, 1], such as 5% or 0.05");
    }
    return value;
}

double parse_budget(const std::string& text)
{
    const char* cursor = text.c_str();
    double value = 0.0;
    const bool number = take_number(cursor, value);
    const std::string unit = cursor;
    value *= unit == "m" ? 60.0 : 1.0;
    if (!number || !(unit.empty() || unit == "s" || unit == "m") || !(value > 0.0 && value <= 1e6)) {
        throw Error(ErrorCode::bad_argument, text + " is no time in (0, 1e6] seconds, such as 20s or 2m");
    }
    return value;
}

EnvironmentChoice parse_environment(const std::string& text)
{
    if (text == "scene") {
        return {};
    }
    if (text == "none") {
        return {glm::vec3(0.0f), {}};
    }
    glm::vec3 radiance(0.0f);
    const char* cursor = text.c_str();
    for (int c = 0; c < 3; ++c) {
        double value = 0.0;
        const bool separated = c == 0 || *cursor++ == ',';
        if (!separated || !take_number(cursor, value) || value < 0.0) {
            break;
        }
        radiance[c] = static_cast<float>(value);
        if (c == 2 && *cursor == '\0' && std::isfinite(radiance.x + radiance.y + radiance.z)) {
            return {radiance, {}};
        }
    }
    std::error_code ignored;
    if (std::filesystem::is_regular_file(text, ignored)) {
        return {std::nullopt, text};
    }
    throw Error(ErrorCode::bad_argument,
                text + " is neither scene nor none nor R,G,B with three values of at least 0 nor a file");
}

std::optional<float> parse_exposure(const std::string& text)
{
    if (text == "auto") {
        return std::nullopt;
    }
    const char* cursor = text.c_str();
    double value = 0.0;
    if (!take_number(cursor, value) || *cursor != '\0' || std::abs(value) > 64.0) {
        throw Error(ErrorCode::bad_argument, text + " is neither auto nor a value in [-64, 64]");
    }
    return static_cast<float>(value);
}

LogLevel parse_log_level(const std::string& text)
{
    return look_up<LogLevel>({{"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}},
                             text);
}

SplatMethod parse_splat_method(const std::string& text)
{
    return look_up<SplatMethod>(
        {{"auto", SplatMethod::automatic}, {"quads", SplatMethod::quads}, {"tiles", SplatMethod::tiles}}, text);
}

}  // namespace rcs::service
