#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <glm/glm.hpp>

#include "rcs/error.h"
#include "rcs/log.h"
#include "rcs/splat.h"
#include "rcs/tone_map.h"

namespace rcs::service {

/// A range as a person reads it: both its check and its place in --help come from here.
struct Range {
    double least = 0.0;
    double most = 0.0;
    bool open = false;  ///< `least` itself is left out
};

inline constexpr double kLargestSeed = 4294967295.0;  // 2^32 - 1

/// Adds a number; its help ends in the range, and shows the default that `value` holds.
template <typename Number>
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& value, Range range, const std::string& help);

struct Size {
    int width = 0;   ///< [px]
    int height = 0;  ///< [px]
};

/// What is looked at: common to all commands that trace rays.
struct SceneArguments {
    std::string scene;
    std::string camera;
    std::string lens_shift;             ///< "RIGHT,UP"; empty: the camera's
    std::string environment = "scene";  ///< the scene's own, "none", "R,G,B" or an image file
    double environment_rotation = 0.0;  ///< of the image [degrees]
    std::optional<double> time;         ///< of its animations [s]; none: the rest pose
    std::string size;                   ///< "WxH"
    int threads = 0;
};
void add_scene_arguments(CLI::App& app, SceneArguments& arguments, Size default_size);

/// Where pictures go and how they are shown.
struct OutputArguments {
    std::vector<std::string> files;
    std::vector<std::string> layers;
    std::vector<std::string> pixel_formats;
    std::string exposure = "auto";
    ToneMapOptions tone_map;
};
/// @param layers  the names that --layers takes
void add_output_arguments(CLI::App& app, OutputArguments& arguments, const std::vector<std::string>& layers);

/// What is told about the run.
struct ReportArguments {
    std::string stats_file;
    std::string log_level = "warning";
    bool quiet = false;
    bool json = false;
};
void add_report_arguments(CLI::App& app, ReportArguments& arguments);

// Texts to values. Each throws rcs::Error bad_argument; they also are the checks of the options above, so
// that a command line that parsed cannot fail here, and CLI11 puts the option's name before the message.
Size parse_size(const std::string& text);
double parse_time(const std::string& text);
/// "0.1,-0.5", to the right and up, in heights of the picture.
glm::dvec2 parse_lens_shift(const std::string& text);
/// "5%" or "0.05". @return in (0, 1]
double parse_error_target(const std::string& text);
/// "20s", "2m" or "20", in seconds. @return [s], in (0, 1e6]
double parse_budget(const std::string& text);
/// What --environment says: nothing, a constant, or the name of a file.
struct EnvironmentChoice {
    std::optional<glm::vec3> radiance;
    std::string file;
};
EnvironmentChoice parse_environment(const std::string& text);
std::optional<float> parse_exposure(const std::string& text);
LogLevel parse_log_level(const std::string& text);
SplatMethod parse_splat_method(const std::string& text);

/// One of the functions above as a check: what is wrong with `text`, or nothing.
template <typename Parse>
std::string check_text(Parse parse, const std::string& text)
{
    try {
        parse(text);
        return {};
    } catch (const Error& e) {
        return e.what();
    }
}

}  // namespace rcs::service
