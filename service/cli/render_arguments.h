#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "rcs/render.h"

namespace rcs::service {

/// What is rendered and how: common to render, and to plan, which says what render would do.
struct RenderArguments {
    SceneArguments scene;
    OutputArguments output;
    ReportArguments report;
    RenderOptions options;
    std::string splat = "auto";
    std::string target_error, budget;
    std::string effects = "auto";
    std::vector<std::string> with, without;
    std::string motion_time, motion_camera;  ///< empty: as the picture's
};
void add_render_arguments(CLI::App& command, RenderArguments& arguments);

/// What the layer `motion` is told by. @param time  of the picture [s]; none: the rest pose
/// @throws rcs::Error bad_argument: a time that is relative to none
std::optional<MotionChoice> motion_choice(const RenderArguments& arguments, std::optional<double> time);
/// @param scene  as the arguments say
std::optional<MotionFrom> motion_from(const RenderArguments& arguments, const Scene& scene);

/// The options as the library takes them: texts parsed, fields that follow from others set.
RenderOptions final_options(const RenderArguments& arguments);

}  // namespace rcs::service
