#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "batch/frames.h"
#include "cli/commands.h"
#include "cli/delivery.h"
#include "cli/describe.h"
#include "cli/job_command.h"
#include "cli/job_run.h"
#include "cli/render_arguments.h"
#include "cli/server_arguments.h"
#include "process/exit_code.h"
#include "rcs/image_io.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

struct SubmitArguments {
    RenderArguments render;
    ServerArguments server;
    std::string frames;
    Shutter shutter;
    int priority = 0;
    std::string key;
    std::vector<std::string> labels;
    double time_limit = 0.0;
    std::vector<std::uint64_t> after;
    int stop_after = 0;
    std::string deliver;
    bool detach = false, on_server = false;
};

void add_frames(const SubmitArguments& arguments, RequestedJob& requested)
{
    if (arguments.frames.empty()) {
        if (arguments.shutter.blurs() && !arguments.render.scene.time)
            throw Error(ErrorCode::bad_argument, "--shutter needs --time or --frames");
        *requested.job.add_frames() = request_frame(arguments.render, 0, arguments.render.scene.time);
        return;
    }
    const std::vector<int> numbers = parse_frames(arguments.frames);
    for (const std::string& path : requested.paths) {
        if (numbers.size() > 1 && !has_frame_pattern(path)) {
            throw Error(ErrorCode::bad_argument, "--output " + path + " needs a #### for the frame's number");
        }
    }
    for (const int number : numbers) {
        const double time = arguments.render.scene.time.value_or(number / arguments.shutter.fps);
        *requested.job.add_frames() = request_frame(arguments.render, number, time);
    }
}

/// Writes frames as they finish. @return the files @throws Ended: some have no pictures
std::vector<std::string> deliver_job(const SubmitArguments& arguments, const RequestedJob& requested, Client& client,
                                     std::uint64_t job, ProgressBar& bar)
{
    std::map<std::string, std::string> patterns;
    for (int i = 0; i < requested.job.outputs_size(); ++i)
        patterns[requested.job.outputs(i).name()] = requested.paths[static_cast<std::size_t>(i)];
    std::vector<std::string> files;
    const auto written = [&](const std::string& path) {
        files.push_back(utf8_text(path));
        if (!arguments.render.report.quiet && !arguments.render.report.json) std::printf("wrote %s\n", path.c_str());
        std::fflush(stdout);
    };
    try {
        Client fetching = connect(arguments.server, Patience::of_a_waiting_client);  // the other one watches
        Delivery delivery(fetching, job, patterns, written,
                          [&](const std::string& warning) { bar.log()(LogLevel::warning, warning); });
        int known = 0;
        follow(client, job, bar, [&](const v1::JobStatus& status) {
            if (std::exchange(known, status.frames_completed()) != status.frames_completed()) delivery.take_new();
        });
        const std::string holes = delivery.take_all();
        if (!holes.empty()) throw Ended(kFailed, holes);
        return files;
    } catch (const Error& e) {
        if (e.code() != ErrorCode::cancelled) throw;
        const std::string number = std::to_string(job);
        throw Error(ErrorCode::cancelled, "interrupted; job " + number + " goes on: rcsplat watch " + number +
                                              " shows it, rcsplat fetch " + number +
                                              " writes its pictures, rcsplat cancel " + number + " ends it");
    }
}

void run_submit(const SubmitArguments& arguments)
{
    ProgressBar bar(parse_log_level(arguments.render.report.log_level), arguments.render.report.quiet);
    RequestedJob requested = request_job(arguments.render, arguments.shutter, arguments.on_server);
    add_frames(arguments, requested);
    requested.job.set_priority(arguments.priority);
    requested.job.set_idempotency_key(arguments.key);
    requested.job.set_time_limit_seconds(arguments.time_limit);
    requested.job.mutable_after()->Assign(arguments.after.begin(), arguments.after.end());
    requested.job.set_deliver(arguments.deliver);
    requested.job.set_stop_after(static_cast<std::uint32_t>(arguments.stop_after));
    for (const std::string& label : arguments.labels) {
        const std::size_t equals = label.find('=');
        if (equals == label.npos || equals == 0)
            throw Error(ErrorCode::bad_argument, "--label " + label + " is no NAME=VALUE");
        (*requested.job.mutable_labels())[label.substr(0, equals)] = label.substr(equals + 1);
    }
    if (!arguments.detach) {
        for (const std::string& path : requested.paths) check_output_path(path_of_frame(path, 0), {});
    }
    Client client = connect(arguments.server, Patience::of_a_waiting_client);
    const v1::SubmitReply submitted = submit(client, requested, bar);
    bar.finish();
    const bool json = arguments.render.report.json;
    if (!json)
        std::printf("job %llu%s\n", static_cast<unsigned long long>(submitted.job()),
                    submitted.existed() ? " (submitted before)" : "");
    std::fflush(stdout);
    std::vector<std::string> written;
    if (!arguments.detach) written = deliver_job(arguments, requested, client, submitted.job(), bar);
    if (json) print_job_json("submit", submitted.job(), {{"existed", submitted.existed()}, {"written", written}});
}

}  // namespace

void add_submit_command(CLI::App& app, Action& action)
{
    CLI::App& command =
        *app.add_subcommand("submit", "Lets a render server render a scene, and waits for the pictures");
    const auto arguments = std::make_shared<SubmitArguments>();
    add_render_arguments(command, arguments->render);
    add_server_arguments(command, arguments->server);
    command.remove_option(command.get_option("--threads"));
    command.remove_option(command.get_option("--asset-root"));
    command.remove_option(command.get_option("--dry-run"));
    command.remove_option(command.get_option("--stats"));
    command.get_option("--json")->description("Print the job's number and the files that were written as JSON");
    command.option_defaults()->group(option_group::kFrames);
    command
        .add_option("--frames", arguments->frames,
                    "Frames of an animation, such as 1-100x2,150; outputs have #### for the number")
        ->type_name("LIST");
    add_fps(command, arguments->shutter.fps);
    add_shutter(command, arguments->shutter);
    command.option_defaults()->group(option_group::kServe);
    add_number(command, "--priority", arguments->priority, {-100, 100}, "Larger ones come first; waiting raises it");
    command.add_option("--key", arguments->key, "Submitted again with the same key, it stays one job")
        ->type_name("KEY");
    command.add_option("--label", arguments->labels, "For whoever looks at the queue; may be given several times")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    add_number(command, "--time-limit", arguments->time_limit, {0, 1e6}, "Wall time of a frame [s]; 0: the server's");
    command
        .add_option("--after", arguments->after,
                    "Job that has to be completed before this one starts; if it fails, so does this one; may be given "
                    "several times")
        ->type_name("JOB")
        ->check(job_number_error, "")
        ->allow_extra_args(false);
    command
        .add_option("--deliver", arguments->deliver,
                    "Folder on the server, beneath its --deliver-root, to which it copies pictures as they finish")
        ->type_name("DIR");
    add_number(command, "--stop-after", arguments->stop_after, {0, 10'000},
               "End the job once so many frames have failed alike; 0: never");
    command.add_flag("--detach", arguments->detach, "Print the job's number and do not wait");
    command.add_flag("--on-server", arguments->on_server,
                     "SCENE is an absolute path on the server, beneath one of its roots");
    command.get_option("--output")->required();
    command.footer(
        "Example: rcsplat submit sponza.glb --camera atrium -o sponza.png\n"
        "Frames are written as they finish. While it waits the server may be stopped and started; Ctrl-C leaves the\n"
        "job in the queue, and rcsplat cancel ends it.");
    command.callback([arguments, &action] { action = [arguments] { run_submit(*arguments); }; });
}

}  // namespace rcs::service
