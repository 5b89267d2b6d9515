#include <memory>

#include <CLI/CLI.hpp>

#include "batch/frames.h"
#include "cli/batch_run.h"
#include "cli/commands.h"
#include "cli/describe.h"

namespace rcs::service {

void add_batch_command(CLI::App& app, Action& action, const std::vector<std::string>& words)
{
    CLI::App& command = *app.add_subcommand("batch", "Renders the frames of an animation that are not done yet");
    const auto arguments = std::make_shared<BatchArguments>();
    add_render_arguments(command, arguments->render);
    for (const char* single : {"--time", "--dry-run", "--stats", "--json"})
        command.remove_option(command.get_option(single));
    command.option_defaults()->group(option_group::kFrames);
    command
        .add_option("--frames", arguments->frames,
                    "Numbers of the frames, such as 1-240x2,300; outputs have #### or %04d in their place")
        ->required()
        ->type_name("LIST")
        ->check(checked_by(parse_frames), "");
    add_fps(command, arguments->fps);
    command.add_flag("--independent-frames", arguments->independent,
                     "Let no frame use records or exposure of another: each is what render makes of it, bit for bit");
    command.add_flag("--overwrite", arguments->overwrite, "Render also frames that are done");
    command.add_flag("--explain", arguments->explain, "Say of each frame why it is rendered, or not");
    command.add_flag("--dry-run", arguments->plan_only, "Say what would be rendered and why, and stop");
    add_number(command, "--retry", arguments->retries, {0, 100},
               "How often a frame is tried again that failed for a reason that may pass");
    add_number(command, "--time-limit", arguments->time_limit, {0, 1e6}, "Wall time of a frame [s]; 0: none");
    command
        .add_option("--report", arguments->report_folder,
                    "Folder for report.html and report.json; default: that of the first output")
        ->type_name("FOLDER");
    command.get_option("--output")->required();
    command.footer(
        "Frames that are done, and depend on nothing that has changed, are left as they are: the same command goes on\n"
        "where it was stopped. SIGTERM ends in order, SIGUSR1 writes the report so far.\n"
        "Example: rcsplat batch demo:atrium --camera walk --frames 1-48 -o frames/atrium.####.png");
    for (const std::string& word : words) arguments->command_line += " " + word;
    arguments->command_line.insert(0, "rcsplat batch");
    command.callback([arguments, &action] { action = [arguments] { run_batch(*arguments); }; });
}

}  // namespace rcs::service
