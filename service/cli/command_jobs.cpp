// watch, fetch, cancel, list and stats: what a client asks a server about its jobs.
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <google/protobuf/util/json_util.h>
#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/delivery.h"
#include "cli/job_run.h"
#include "cli/server_arguments.h"
#include "process/exit_code.h"
#include "process/printable.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

struct JobArguments {
    ServerArguments server;
    std::uint64_t job = 0;
    bool json = false;
};

std::string json_of(const google::protobuf::Message& message)
{
    google::protobuf::util::JsonPrintOptions options;
    options.always_print_primitive_fields = true;
    options.preserve_proto_field_names = true;
    std::string text;
    const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
    if (!status.ok()) throw Error(ErrorCode::internal, "cannot write a message as JSON");
    return text;
}

std::string time_text(std::int64_t ms)
{
    if (ms == 0) return "-";
    const std::time_t seconds = ms / 1000;
    std::tm local{};
    localtime_r(&seconds, &local);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &local);
    return text;
}

void print_line(const v1::JobStatus& status)
{
    std::printf("%8llu  %-23s %5d/%-5d %4d  %-19s  %s", static_cast<unsigned long long>(status.job()),
                state_text(status.state()).c_str(), status.frames_completed(), status.frames(), status.priority(),
                time_text(status.submitted_ms()).c_str(), printable(status.scene()).c_str());
    if (status.has_error()) std::printf("  %s", printable(status.error().message()).c_str());
    std::putchar('\n');
}

void run_watch(const JobArguments& arguments)
{
    Client client = connect(arguments.server, Patience::of_a_waiting_client);
    const auto show = [&](const v1::JobStatus& status) {
        if (arguments.json) {
            std::printf("%s\n", json_of(status).c_str());
        } else {
            std::printf("job %llu %s %d/%d", static_cast<unsigned long long>(status.job()),
                        state_text(status.state()).c_str(), status.frames_completed(), status.frames());
            for (const v1::Progress& p : status.running()) {
                std::printf("  frame %d %s %.0f %%", p.frame(), printable(p.stage()).c_str(), 100.0 * p.fraction());
                if (p.has_error_estimate()) std::printf(" error %.1f %%", 100.0 * p.error_estimate());
                if (p.has_eta_seconds()) std::printf(" eta %.0f s", p.eta_seconds());
            }
            std::putchar('\n');
        }
        std::fflush(stdout);
    };
    const v1::JobStatus end = client.watch(arguments.job, show);
    if (end.state() == v1::JOB_STATE_CANCELLED)
        throw ServiceError(v1::ERROR_CODE_CANCELLED, "job " + std::to_string(arguments.job) + " was cancelled");
    if (end.state() == v1::JOB_STATE_FAILED) throw ServiceError(end.error().code(), end.error().message());
}

struct FetchArguments : JobArguments {
    std::string folder = ".";
    int frame = 0;
};

void run_fetch(const FetchArguments& arguments, bool one_frame)
{
    Client client = connect(arguments.server, Patience::of_a_waiting_client);
    const v1::JobReply job = client.details(arguments.job, 0, 1);
    std::map<std::string, std::string> patterns;
    for (const v1::Output& output : job.job().outputs())
        patterns[output.name()] = path_of_output(arguments.folder, output, job.status().frames());
    Delivery delivery(
        client, arguments.job, patterns, [](const std::string& path) { std::printf("wrote %s\n", path.c_str()); },
        [](const std::string&) {});
    const std::string holes = delivery.take_all(one_frame ? std::optional(arguments.frame) : std::nullopt);
    if (!holes.empty()) throw Ended(kFailed, holes);
}

void run_cancel(const JobArguments& arguments)
{
    Client client = connect(arguments.server);
    const v1::CancelReply reply = client.cancel(arguments.job);
    std::printf("job %llu %s%s\n", static_cast<unsigned long long>(arguments.job),
                reply.had_ended() ? "had ended before, nothing was cancelled: " : "",
                state_text(reply.state()).c_str());
}

struct ListArguments {
    ServerArguments server;
    int limit = 100;
    std::uint64_t job = 0;
    std::vector<std::string> labels;
    bool json = false;
};

void run_list(const ListArguments& arguments)
{
    Client client = connect(arguments.server);
    if (arguments.job != 0) {
        const v1::JobReply reply = client.details(arguments.job, 0, 10);
        if (arguments.json) {
            std::printf("%s\n", json_of(reply).c_str());
            return;
        }
        print_line(reply.status());
        for_each_frame(client, arguments.job, [](const v1::FrameStatus& frame) {
            std::printf("  frame %d %s, %.1f s, %d attempts", frame.number(), state_text(frame.state()).c_str(),
                        frame.seconds(), frame.attempts());
            if (frame.has_error()) std::printf(": %s", printable(frame.error().message()).c_str());
            std::putchar('\n');
            for (const v1::OutputFile& file : frame.files())
                std::printf("    %s, %llu bytes\n", file.name().c_str(), static_cast<unsigned long long>(file.size()));
            for (const std::string& warning : frame.warnings())
                std::printf("    warning: %s\n", printable(warning).c_str());
        });
        return;
    }
    v1::Request request;
    request.mutable_list()->set_limit(static_cast<std::uint32_t>(arguments.limit));
    for (const std::string& label : arguments.labels) {
        const std::size_t equals = label.find('=');
        if (equals == label.npos) throw Error(ErrorCode::bad_argument, "--label " + label + " is no NAME=VALUE");
        (*request.mutable_list()->mutable_labels())[label.substr(0, equals)] = label.substr(equals + 1);
    }
    const v1::ListReply reply = client.call(request).list();
    if (arguments.json) {
        std::printf("%s\n", json_of(reply).c_str());
        return;
    }
    std::printf("%8s  %-23s %11s %4s  %-19s  %s\n", "job", "state", "frames", "prio", "submitted", "scene");
    for (const v1::JobStatus& status : reply.jobs()) print_line(status);
    if (reply.more()) std::puts("... and older ones");
}

struct StatsArguments {
    ServerArguments server;
    bool prometheus = false, json = false;
};

void run_stats(const StatsArguments& arguments)
{
    Client client = connect(arguments.server);
    v1::Request request;
    request.mutable_stats()->set_prometheus(arguments.prometheus);
    const v1::StatsReply reply = client.call(request).stats();
    if (arguments.prometheus) {
        std::fputs(reply.prometheus().c_str(), stdout);
    } else if (arguments.json) {
        std::printf("%s\n", json_of(reply).c_str());
    } else {
        const std::map<std::string, double> sorted(reply.values().begin(), reply.values().end());
        for (const auto& [name, value] : sorted) std::printf("%-36s %.10g\n", name.c_str(), value);
    }
}

std::string check_job_number(const std::string& text)
{
    const bool is_number = text.find_first_not_of("0123456789") == text.npos && text.size() <= 18 &&
                           text.find_first_not_of('0') != text.npos;
    return is_number ? std::string() : text + " is no number of a job, expected a whole number >= 1";
}

template <typename Arguments>
CLI::App& add_job_command(CLI::App& app, const char* name, const char* help, Arguments& arguments)
{
    CLI::App& command = *app.add_subcommand(name, help);
    command.add_option("job", arguments.job, "Its number, as submit printed it")
        ->required()
        ->type_name("JOB")
        ->check(check_job_number, "");
    add_server_arguments(command, arguments.server);
    return command;
}

}  // namespace

void add_job_commands(CLI::App& app, Action& action)
{
    const auto watch = std::make_shared<JobArguments>();
    CLI::App& watch_command = add_job_command(app, "watch", "Shows how a job goes on until it has ended", *watch);
    watch_command.add_flag("--json", watch->json, "Print states as JSON, one a line");
    watch_command.footer("Example: rcsplat watch 12");
    watch_command.callback([watch, &action] { action = [watch] { run_watch(*watch); }; });

    const auto fetch = std::make_shared<FetchArguments>();
    CLI::App& fetch_command = add_job_command(app, "fetch", "Writes the pictures of a job", *fetch);
    fetch_command.add_option("-o,--output", fetch->folder, "Folder to write them to")
        ->type_name("DIR")
        ->capture_default_str();
    CLI::Option* frame = add_number(fetch_command, "--frame", fetch->frame, {-1e7, 1e7}, "Only those of this frame");
    fetch_command.footer("Example: rcsplat fetch 12 -o pictures");
    fetch_command.callback(
        [fetch, frame, &action] { action = [fetch, frame] { run_fetch(*fetch, frame->count() > 0); }; });

    const auto cancel = std::make_shared<JobArguments>();
    CLI::App& cancel_command = add_job_command(app, "cancel", "Ends a job; frames that are done stay", *cancel);
    cancel_command.footer("Example: rcsplat cancel 12");
    cancel_command.callback([cancel, &action] { action = [cancel] { run_cancel(*cancel); }; });

    const auto list = std::make_shared<ListArguments>();
    CLI::App& list_command =
        *app.add_subcommand("list", "Lists the jobs of a server, the newest first, or the frames of one");
    list_command.add_option("job", list->job, "Only this job, with its frames")->type_name("JOB");
    add_number(list_command, "--limit", list->limit, {1, 1000}, "At most so many");
    list_command.add_option("--label", list->labels, "Only jobs that have it; may be given several times")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    list_command.add_flag("--json", list->json, "Print JSON");
    add_server_arguments(list_command, list->server);
    list_command.footer("Example: rcsplat list");
    list_command.callback([list, &action] { action = [list] { run_list(*list); }; });

    const auto stats = std::make_shared<StatsArguments>();
    CLI::App& stats_command = *app.add_subcommand("stats", "Prints the counters of a server");
    stats_command.add_flag("--prometheus", stats->prometheus, "As Prometheus reads them");
    stats_command.add_flag("--json", stats->json, "Print JSON");
    add_server_arguments(stats_command, stats->server);
    stats_command.footer("Example: rcsplat stats --prometheus");
    stats_command.callback([stats, &action] { action = [stats] { run_stats(*stats); }; });
}

}  // namespace rcs::service
