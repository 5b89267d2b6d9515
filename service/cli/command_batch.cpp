#include <memory>

#include <CLI/CLI.hpp>

#include "batch/frames.h"
#include "batch/pace.h"
#include "cli/batch_nights.h"
#include "cli/batch_run.h"
#include "cli/commands.h"
#include "cli/describe.h"
#include "cli/number.h"
#include "cli/parse.h"
#include "process/clock.h"
#include "rcs/option_table.h"

namespace rcs::service {

namespace {

void add_task_arguments(CLI::App& command, BatchArguments& arguments)
{
    command.option_defaults()->group(option_group::kFarm);
    command
        .add_option_function<std::string>(
            "--task", [&](const std::string& text) { arguments.task = parse_task(text); },
            "Do a part of the batch: K/N renders the K-th of N parts of the frames, overture/N before them the first "
            "frames of parts, whose records and exposure the others begin with, report tells after them what is there")
        ->type_name("K/N|overture/N|report")
        ->check(checked_by(parse_task), "");
    command
        .add_option("--records", arguments.records_file,
                    "Begin with the records in this file, if there is one; an overture and a batch in one task save "
                    "theirs there")
        ->type_name("FILE");
    command
        .add_option_function<std::string>(
            "--engine", [&](const std::string& text) { arguments.engine = parse_engine(text); },
            "Write a folder with the batch in tasks, and start it: here, one after the other, as jobs of Slurm, or as "
            "a template of Open Job Description")
        ->type_name("local|slurm|openjd")
        ->check(checked_by(parse_engine), "");
    add_number(command, "--chunk", arguments.chunk, {1, 10'000}, "Most frames of a task");
    command.add_option("--job-folder", arguments.job_folder, "Folder of these tasks; default: job, beside the report")
        ->type_name("FOLDER");
    command.add_flag("!--no-submit", arguments.submits, "Write that folder alone, and say how it is started");
    for (const char* farm : {"--chunk", "--job-folder", "--no-submit"}) command.get_option(farm)->needs("--engine");
    for (const char* other : {"--task", "--records", "--dry-run", "--explain", "--overwrite"})
        command.get_option("--engine")->excludes(other);
    // Frames that an overture has made would be made again, and none would be done for the report.
    command.get_option("--task")->excludes("--overwrite");
    command.get_option("--records")->excludes("--independent-frames");
}

void add_deadline(CLI::App& command, BatchArguments& arguments)
{
    const auto seconds = [](const std::string& text) { return seconds_until(text, read_clocks().wall_ms); };
    CLI::Option* deadline =
        command
            .add_option_function<std::string>(
                "--deadline",
                [&arguments, seconds](const std::string& text) {
                    arguments.deadline_ms = steady_ms() + static_cast<std::int64_t>(1e3 * seconds(text));
                },
                "Make frames as good as they can all be by then, and say beforehand how good that is: a time such as "
                "06:00 or 2026-11-24T06:00, or +1h30m from now")
            ->type_name("TIME")
            ->check(checked_by(seconds), "");
    for (const OptionInfo& option : option_table())
        if (quality_of(option) != kAnyQuality) deadline->excludes(std::string(option.name));
    for (const char* other : {"--task", "--records", "--engine"}) deadline->excludes(other);
}

void add_server(CLI::App& command, BatchArguments& arguments)
{
    add_server_arguments(command, arguments.server);
    command.get_option("--server")
        ->envname("")
        ->default_str("")
        ->description("Let this render server make the frames: a socket or HOST:PORT");
    for (const char* local : {"--threads", "--asset-root", "--retry", "--task", "--engine", "--records", "--deadline"})
        command.get_option("--server")->excludes(local);
}

}  // namespace

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
    add_fps(command, arguments->shutter.fps);
    add_shutter(command, arguments->shutter);
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
    command.add_flag("!--no-movie", arguments->makes_movie,
                     "Make no preview.mp4 beside the report: where ffmpeg is installed it shows the PNG or JPEG files");
    add_number(command, "--keep-nights", arguments->keep_nights, {0, 10'000},
               "With {night} in --output, which is the night's date: once all frames are there, remove what the batch "
               "wrote in nights before the last N; 0: nothing");
    command.get_option("--output")->required();
    // It has become words when the command line is parsed.
    command
        .add_option("--config", arguments->description,
                    "File with these options, one a line, as in: frames = \"1-240\", and scene = \"NAME\"; those of "
                    "the command line come first")
        ->type_name("FILE");
    add_task_arguments(command, *arguments);
    command.option_defaults()->group(option_group::kFrames);
    add_deadline(command, *arguments);
    add_server(command, *arguments);
    command.footer(
        "Frames that are done, and depend on nothing that has changed, are left as they are: the same command goes on\n"
        "where it was stopped. SIGTERM ends in order, SIGUSR1 writes the report so far.\n"
        "Example: rcsplat batch demo:atrium --camera walk --frames 1-48 -o frames/atrium.####.png");
    for (const std::string& word : words) arguments->command_line += " " + word;
    arguments->command_line.insert(0, "rcsplat batch");
    arguments->words = words;
    command.callback([arguments, &command, &action] {
        const bool farm = command.get_option("--engine")->count() > 0;
        arguments->on_server = command.get_option("--server")->count() > 0;
        begin_night(*arguments);
        for (std::string& word : arguments->words) word = at_night(word, arguments->night);
        action = [arguments, farm] { farm ? run_farm(*arguments) : run_batch(*arguments); };
    });
}

}  // namespace rcs::service
