#pragma once

#include <string>

#include "cli/render_arguments.h"

namespace rcs::service {

struct BatchArguments {
    RenderArguments render;
    std::string frames;         ///< as parse_frames() takes them
    double fps = 24.0;          ///< frame N shows the scene at N / fps
    bool independent = false;   ///< nothing of a frame helps another
    bool overwrite = false;     ///< also frames that are done
    bool explain = false;       ///< tell of each frame why it is rendered or not
    bool plan_only = false;     ///< and render none
    int retries = 1;            ///< of frames that fail for a reason that may pass
    double time_limit = 0.0;    ///< of a frame [s]; 0: none
    std::string report_folder;  ///< empty: that of the first output
    std::string command_line;   ///< for the report
};

/// Renders the frames that are not done yet, in this process, and writes the report.
/// @throws Ended, unless all frames are there and nothing was warned of; rcs::Error before any work
void run_batch(const BatchArguments& arguments);

}  // namespace rcs::service
