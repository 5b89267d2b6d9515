// retry, pause, resume, priority and logs: what a client does about jobs that a server has.
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "batch/frames.h"
#include "cli/commands.h"
#include "cli/job_command.h"
#include "cli/job_run.h"
#include "cli/number.h"
#include "cli/parse.h"
#include "process/printable.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

unsigned long long shown(std::uint64_t job) { return job; }

struct RetryArguments : JobArguments {
    std::string frames;
};

void run_retry(const RetryArguments& arguments)
{
    v1::Request request;
    request.mutable_retry()->set_job(arguments.job);
    if (!arguments.frames.empty()) {
        for (const int number : parse_frames(arguments.frames)) request.mutable_retry()->add_frames(number);
    }
    Client client = connect(arguments.server);
    const v1::RetryReply reply = client.call(request).retry();
    if (reply.frames() == 0) {
        std::printf("job %llu %s: no such frame had failed or been cancelled\n", shown(arguments.job),
                    state_text(reply.state()).c_str());
    } else {
        std::printf("job %llu %s: %u frame%s wait%s again\n", shown(arguments.job), state_text(reply.state()).c_str(),
                    reply.frames(), reply.frames() > 1 ? "s" : "", reply.frames() > 1 ? "" : "s");
    }
}

struct PauseArguments {
    ServerArguments server;
    std::uint64_t job = 0;
    bool queue = false;
};

void run_pause(const PauseArguments& arguments, bool resume)
{
    if (arguments.queue == (arguments.job != 0))
        throw Error(ErrorCode::bad_argument, "expected either a job's number or --queue");
    v1::Request request;
    request.mutable_pause()->set_job(arguments.job);
    request.mutable_pause()->set_resume(resume);
    Client client = connect(arguments.server);
    const v1::PauseReply reply = client.call(request).pause();
    const std::string before = reply.was_so() ? " before, nothing was changed" : "";
    if (arguments.queue) {
        std::printf("the queue %s%s\n", resume ? "goes on" : "is paused", before.c_str());
    } else {
        std::printf("job %llu %s%s\n", shown(arguments.job), state_text(reply.state()).c_str(),
                    reply.was_so() ? ", as it was" : "");
    }
}

struct PriorityArguments : JobArguments {
    int priority = 0;
};

void run_priority(const PriorityArguments& arguments)
{
    v1::Request request;
    request.mutable_priority()->set_job(arguments.job);
    request.mutable_priority()->set_priority(arguments.priority);
    Client client = connect(arguments.server);
    const int before = client.call(request).priority().before();
    std::printf("job %llu has priority %d, %d before\n", shown(arguments.job), arguments.priority, before);
}

struct LogsArguments : JobArguments {
    int frame = 0;
};

void print_log(Client& client, std::uint64_t job, int frame)
{
    v1::Request request;
    request.mutable_logs()->set_job(job);
    request.mutable_logs()->set_frame(frame);
    const std::string text = client.call(request).logs().text();
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::printf("frame %d %s\n", frame, printable(text.substr(begin, end - begin)).c_str());
        begin = end + 1;
    }
}

void run_logs(const LogsArguments& arguments, bool one_frame)
{
    Client client = connect(arguments.server);
    if (one_frame) return print_log(client, arguments.job, arguments.frame);
    for_each_frame(client, arguments.job, [&](const v1::FrameStatus& frame) {
        if (frame.started_ms() != 0) print_log(client, arguments.job, frame.number());
    });
}

void add_pause_command(CLI::App& app, Action& action, bool resume)
{
    const auto arguments = std::make_shared<PauseArguments>();
    CLI::App& command =
        resume ? *app.add_subcommand("resume", "Lets a job that is paused go on, or the whole queue")
               : *app.add_subcommand("pause", "Starts no more frames of a job, or of any; those that run end");
    command.add_option("job", arguments->job, "Its number, as submit printed it")
        ->type_name("JOB")
        ->check(job_number_error, "");
    command.add_flag("--queue", arguments->queue, "The whole queue; for the user that runs the server");
    add_server_arguments(command, arguments->server);
    command.footer(resume ? "Example: rcsplat resume 12" : "Example: rcsplat pause 12");
    command.callback([arguments, resume, &action] { action = [arguments, resume] { run_pause(*arguments, resume); }; });
}

}  // namespace

void add_hold_commands(CLI::App& app, Action& action)
{
    const auto retry = std::make_shared<RetryArguments>();
    CLI::App& retry_command =
        add_job_command(app, "retry", "Lets frames that failed or were cancelled wait again in their job", *retry);
    retry_command.add_option("--frames", retry->frames, "Only these, such as 1-100x2,150")
        ->type_name("LIST")
        ->check(checked_by(parse_frames), "");
    retry_command.footer("Example: rcsplat retry 12 --frames 7,31-35");
    retry_command.callback([retry, &action] { action = [retry] { run_retry(*retry); }; });

    add_pause_command(app, action, false);
    add_pause_command(app, action, true);

    const auto priority = std::make_shared<PriorityArguments>();
    CLI::App& priority_command = add_job_command(app, "priority", "Changes a job's priority", *priority);
    add_number(priority_command, "priority", priority->priority, {-100, 100}, "Larger ones come first")->required();
    priority_command.footer("Example: rcsplat priority 12 50");
    priority_command.callback([priority, &action] { action = [priority] { run_priority(*priority); }; });

    const auto logs = std::make_shared<LogsArguments>();
    CLI::App& logs_command =
        add_job_command(app, "logs", "Prints what was said while a job's frames were tried", *logs);
    CLI::Option* frame = add_number(logs_command, "--frame", logs->frame, {-1e7, 1e7}, "Only of this frame");
    logs_command.footer("Example: rcsplat logs 12 --frame 7");
    logs_command.callback([logs, frame, &action] { action = [logs, frame] { run_logs(*logs, frame->count() > 0); }; });
}

}  // namespace rcs::service
