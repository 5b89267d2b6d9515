#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "batch/farm.h"
#include "batch/nights.h"
#include "batch/tasks.h"
#include "cli/render_arguments.h"
#include "cli/server_arguments.h"
#include "cli/shutter.h"

namespace rcs::service {

struct BatchArguments {
    RenderArguments render;
    std::string frames;         ///< as parse_frames() takes them
    Shutter shutter;            ///< frame N shows the scene at N / fps, or around it
    bool independent = false;   ///< nothing of a frame helps another
    bool overwrite = false;     ///< also frames that are done
    bool explain = false;       ///< tell of each frame why it is rendered or not
    bool plan_only = false;     ///< and render none
    int retries = 1;            ///< of frames that fail for a reason that may pass
    double time_limit = 0.0;    ///< of a frame [s]; 0: none
    std::string report_folder;  ///< empty: that of the first output
    bool makes_movie = true;    ///< beside the report, where there is a program for it
    NightlyFiles nightly;       ///< where these go, with "{night}"
    std::string night;          ///< its date
    int keep_nights = 0;        ///< of those files; 0: all
    std::string description;    ///< file that the other words come from
    std::string command_line;   ///< for the report

    bool on_server = false;  ///< a render server makes the frames, not this process
    ServerArguments server;

    std::optional<std::int64_t> deadline_ms;  ///< by steady_ms(); frames are as good as they can be until then

    Task task;
    std::string records_file;  ///< of records that tasks share; empty: none
    Engine engine = Engine::local;
    int chunk = 8;                   ///< frames of a part, at most
    std::string job_folder;          ///< of an engine; empty: `job` beside the report
    bool submits = true;             ///< else the folder is written alone
    std::vector<std::string> words;  ///< of the command line after "batch"
};

/// Renders the frames of a task that are not done yet, in this process or by a server, and writes the report where the
/// task has one.
/// @throws Ended, unless all frames are there and nothing was warned of; rcs::Error before any work
void run_batch(const BatchArguments& arguments);

/// Writes the folder of a job that does the same in tasks, and starts it.
/// @throws Ended with what it ended in; rcs::Error before any work
void run_farm(const BatchArguments& arguments);

}  // namespace rcs::service
