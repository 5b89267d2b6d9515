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
};
void add_render_arguments(CLI::App& command, RenderArguments& arguments);

/// The options as the library takes them: texts parsed, fields that follow from others set.
RenderOptions final_options(const RenderArguments& arguments);

}  // namespace rcs::service
