#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "cli/table_options.h"
#include "rcs/render_options.h"

namespace rcs::service {

/// What is rendered and how: common to render, and to plan, which says what render would do.
struct RenderArguments {
    SceneArguments scene;
    OutputArguments output;
    ReportArguments report;
    OptionTexts options;
    bool dry_run = false;  ///< say what which error would cost, and stop
    std::string effects = "auto";
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
