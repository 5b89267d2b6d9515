#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/number.h"
#include "cli/parse.h"
#include "rcs/camera_path.h"
#include "rcs/layers.h"
#include "rcs/scene_choice.h"
#include "rcs/tone_map.h"

namespace rcs::service {

/// What is looked at: common to all commands that trace rays.
struct SceneArguments {
    static constexpr double kDefaultFov = 45.0;

    std::string scene;
    std::string camera;
    std::string eye, target, up;        ///< "X,Y,Z" of a camera beside the scene's; empty: none, up +Y
    double fov = kDefaultFov;           ///< of that camera, vertically [degrees]
    std::string camera_path;            ///< a file; empty: none
    std::string lens_shift;             ///< "RIGHT,UP"; empty: the camera's
    std::string asset_root;             ///< folder; empty: the scene's own
    std::string environment = "scene";  ///< the scene's own, "none", "R,G,B" or an image file
    double environment_rotation = 0.0;  ///< of the image [degrees]
    std::optional<double> time;         ///< of its animations [s]; none: the rest pose
    std::string animation;              ///< that poses it; empty: all
    std::string size;                   ///< "WxH"
    int threads = 0;
};
void add_scene_arguments(CLI::App& app, SceneArguments& arguments, Size default_size);

// What these say, as the library takes it.
SceneChoice scene_choice(const SceneArguments& arguments);
/// @param time  of the picture [s]; none: the rest pose, where a camera path begins at 0
CameraChoice camera_choice(const SceneArguments& arguments, std::optional<double> time);

/// What is looked through from frame to frame: camera_choice(), its file read once.
class CameraSource {
public:
    /// @throws rcs::Error as load_camera_path(); bad_argument
    explicit CameraSource(const SceneArguments& arguments);
    /// @throws rcs::Error as camera_at()
    CameraChoice at(std::optional<double> time) const;
    /// Of a camera beside the scene's.
    const std::optional<CameraPath>& path() const { return path_; }

private:
    CameraChoice choice_;             ///< without a path
    std::optional<CameraPath> path_;  ///< of one key, if the camera does not move
};

/// --fps of commands that render frames.
void add_fps(CLI::App& app, double& fps,
             const std::string& help = "Frames a second: frame N shows the scene at N / fps");

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
/// Those of them that say how a picture is shown.
void add_display_arguments(CLI::App& app, OutputArguments& arguments);

/// What is told about the run.
struct ReportArguments {
    std::string stats_file;
    std::string log_level = "warning";
    bool quiet = false;
    bool json = false;
};
void add_report_arguments(CLI::App& app, ReportArguments& arguments);
/// That of them that any command takes which logs.
void add_log_level(CLI::App& app, ReportArguments& arguments);

}  // namespace rcs::service
