#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/number.h"
#include "cli/parse.h"
#include "rcs/layers.h"
#include "rcs/scene_choice.h"
#include "rcs/tone_map.h"

namespace rcs::service {

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

// What these say, as the library takes it.
SceneChoice scene_choice(const SceneArguments& arguments);
CameraChoice camera_choice(const SceneArguments& arguments);

/// Where pictures go and how they are shown.
struct OutputArguments {
    std::vector<std::string> files;
    std::vector<std::string> layers;
    std::vector<std::string> pixel_formats;
    std::string exposure = "auto";
    ToneMapOptions tone_map;
};
/// @param renderer  whose layers --layers takes
void add_output_arguments(CLI::App& app, OutputArguments& arguments, Renderer renderer);

/// What is told about the run.
struct ReportArguments {
    std::string stats_file;
    std::string log_level = "warning";
    bool quiet = false;
    bool json = false;
};
void add_report_arguments(CLI::App& app, ReportArguments& arguments);

}  // namespace rcs::service
