// watch, fetch, cancel, list and stats: what a client asks a server about its jobs.
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <google/protobuf/util/json_util.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "batch/frames.h"
#include "cli/commands.h"
#include "cli/delivery.h"
#include "cli/job_command.h"
#include "cli/job_run.h"
#include "cli/server_arguments.h"
#include "process/clock.h"
#include "process/exit_code.h"
#include "process/printable.h"
#include "report/encoding.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

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

void print_line(const v1::JobStatus& status)
{
    std::printf("%8llu  %-23s %5d/%-5d %4d  %-19s  %s", static_cast<unsigned long long>(status.job()),
                state_text(status.state()).c_str(), status.frames_completed(), status.frames(), status.priority(),
                status.submitted_ms() == 0 ? "-" : local_text(status.submitted_ms()).c_str(),
                printable(status.scene()).c_str());
    if (status.started_ms() != 0) std::printf("  waited %s", duration_text(status.waited_seconds()).c_str());
    if (status.finished_ms() != 0 && status.started_ms() != 0) {
        const double took = 1e-3 * static_cast<double>(status.finished_ms() - status.started_ms());
        std::printf(", took %s", duration_text(took).c_str());
    }
    if (status.has_eta_seconds()) std::printf("  %s to go", duration_text(status.eta_seconds()).c_str());
    for (int i = 0; i < status.waits_for_size(); ++i)
        std::printf("%s%llu", i == 0 ? "  after job " : ", ", static_cast<unsigned long long>(status.waits_for(i)));
    if (status.has_error()) std::printf("  %s", printable(status.error().message()).c_str());
    std::putchar('\n');
}

void run_watch(const JobArguments& arguments)
{
    Client client = connect(arguments.server, Patience::of_a_waiting_client);
    ProgressBar bar(LogLevel::warning, arguments.json);
    const v1::JobStatus end = follow(client, arguments.job, bar, [&](const v1::JobStatus& status) {
        if (!arguments.json) return;
        std::printf("%s\n", json_of(status).c_str());
        std::fflush(stdout);
    });
    if (!arguments.json) {
        std::printf("job %llu %s\n", static_cast<unsigned long long>(arguments.job), progress_text(end).c_str());
        std::fflush(stdout);
    }
    if (end.state() == v1::JOB_STATE_CANCELLED)
        throw ServiceError(v1::ERROR_CODE_CANCELLED, "job " + std::to_string(arguments.job) + " was cancelled");
    if (end.state() == v1::JOB_STATE_FAILED) throw Ended(kFailed, printable(end.error().message()));
}

struct FetchArguments : JobArguments {
    std::string folder = ".";
    int frame = 0;
};

/// Paths of a job's outputs, by their names, as whoever submitted it called them.
std::map<std::string, std::string> patterns_of(const v1::JobReply& job, const std::string& folder)
{
    std::map<std::string, std::string> patterns;
    for (const v1::Output& output : job.job().outputs())
        patterns[output.name()] = path_of_output(folder, output, job.status().frames());
    return patterns;
}

void run_fetch(const FetchArguments& arguments, bool one_frame)
{
    Client client = connect(arguments.server, Patience::of_a_waiting_client);
    const v1::JobReply job = client.details(arguments.job, 0, 1);
    const auto patterns = patterns_of(job, arguments.folder);
    nlohmann::ordered_json written = nlohmann::ordered_json::array();
    const auto tell = [&](const std::string& path) {
        written.push_back(utf8_text(path));
        if (!arguments.json) std::printf("wrote %s\n", path.c_str());
    };
    Delivery delivery(client, arguments.job, patterns, tell, [](const std::string&) {});
    const std::string holes = delivery.take_all(one_frame ? std::optional(arguments.frame) : std::nullopt);
    if (arguments.json) print_job_json("fetch", arguments.job, {{"written", written}});
    if (!holes.empty()) throw Ended(kFailed, holes);
}

void run_cancel(const JobArguments& arguments)
{
    Client client = connect(arguments.server);
    const v1::CancelReply reply = client.cancel(arguments.job);
    if (arguments.json) {
        print_job_json("cancel", arguments.job,
                       {{"state", state_text(reply.state())}, {"had_ended", reply.had_ended()}});
        return;
    }
    std::printf("job %llu %s%s\n", static_cast<unsigned long long>(arguments.job),
                reply.had_ended() ? "had ended before, nothing was cancelled: " : "",
                state_text(reply.state()).c_str());
}

struct ListArguments {
    ServerArguments server;
    int limit = 100;
    std::uint64_t job = 0;
    std::vector<std::string> labels, states;
    std::string owner;
    bool json = false;
};

/// "failed" as its state. @throws rcs::Error bad_argument
v1::JobState parse_state(const std::string& text)
{
    std::string names;
    for (int i = v1::JobState_MIN + 1; i < v1::JobState_ARRAYSIZE; ++i) {
        const auto state = static_cast<v1::JobState>(i);
        if (state_text(state) == text) return state;
        names.append(names.empty() ? "" : ", ").append(state_text(state));
    }
    throw Error(ErrorCode::bad_argument, "--state " + text + " is none of " + names);
}

/// @param patterns  what `fetch` calls the outputs
void print_frame(const v1::FrameStatus& frame, const std::map<std::string, std::string>& patterns)
{
    std::printf("  frame %d %s, %.1f s, %d attempt%s", frame.number(), state_text(frame.state()).c_str(),
                frame.seconds(), frame.attempts(), frame.attempts() == 1 ? "" : "s");
    if (frame.has_error()) std::printf(": %s", printable(frame.error().message()).c_str());
    std::putchar('\n');
    for (const v1::OutputFile& file : frame.files()) {
        const auto pattern = patterns.find(file.name());
        if (pattern == patterns.end()) continue;
        std::printf("    %s, %llu bytes\n", printable(path_of_frame(pattern->second, frame.number())).c_str(),
                    static_cast<unsigned long long>(file.size()));
    }
    for (const std::string& warning : frame.warnings()) std::printf("    warning: %s\n", printable(warning).c_str());
}

void list_job(const ListArguments& arguments)
{
    Client client = connect(arguments.server);
    const v1::JobReply reply = client.details(arguments.job, 0, 10);
    if (arguments.json) {
        std::printf("%s\n", json_of(reply).c_str());
        return;
    }
    const auto patterns = patterns_of(reply, "");
    print_line(reply.status());
    for_each_frame(client, arguments.job, [&](const v1::FrameStatus& frame) { print_frame(frame, patterns); });
}

void run_list(const ListArguments& arguments)
{
    if (arguments.job != 0) {
        list_job(arguments);
        return;
    }
    v1::Request request;
    request.mutable_list()->set_limit(static_cast<std::uint32_t>(arguments.limit));
    request.mutable_list()->set_owner(arguments.owner);
    for (const std::string& state : arguments.states) request.mutable_list()->add_states(parse_state(state));
    for (const std::string& label : arguments.labels) {
        const std::size_t equals = label.find('=');
        if (equals == label.npos) throw Error(ErrorCode::bad_argument, "--label " + label + " is no NAME=VALUE");
        (*request.mutable_list()->mutable_labels())[label.substr(0, equals)] = label.substr(equals + 1);
    }
    Client client = connect(arguments.server);
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
    bool prometheus = false, json = false, health = false;
};

/// Whether jobs are taken and frames started, and why not.
void run_health(Client& client, bool json)
{
    v1::Request request;
    request.mutable_health();
    const v1::HealthReply reply = client.call(request).health();
    const std::string why = printable(reply.message());
    if (json) {
        std::printf("%s\n", json_of(reply).c_str());
    } else if (reply.serving()) {
        std::printf("serving: %u workers, %u busy, %llu frames wait%s%s\n", reply.workers(), reply.busy(),
                    static_cast<unsigned long long>(reply.queued_frames()), why.empty() ? "" : "; ", why.c_str());
    }
    if (!reply.serving()) throw Ended(kFailed, "not serving: " + why);
}

void run_stats(const StatsArguments& arguments)
{
    Client client = connect(arguments.server);
    if (arguments.health) {
        run_health(client, arguments.json);
        return;
    }
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
    fetch_command.add_flag("--json", fetch->json, "Print the files that were written as JSON");
    fetch_command.footer("Example: rcsplat fetch 12 -o pictures");
    fetch_command.callback(
        [fetch, frame, &action] { action = [fetch, frame] { run_fetch(*fetch, frame->count() > 0); }; });

    const auto cancel = std::make_shared<JobArguments>();
    CLI::App& cancel_command = add_job_command(app, "cancel", "Ends a job; frames that are done stay", *cancel);
    cancel_command.add_flag("--json", cancel->json, "Print what came of it as JSON");
    cancel_command.footer("Example: rcsplat cancel 12");
    cancel_command.callback([cancel, &action] { action = [cancel] { run_cancel(*cancel); }; });

    const auto list = std::make_shared<ListArguments>();
    CLI::App& list_command =
        *app.add_subcommand("list", "Lists the jobs of a server, the newest first, or the frames of one");
    list_command.add_option("job", list->job, "Only this job, with its frames")
        ->type_name("JOB")
        ->check(job_number_error, "");
    add_number(list_command, "--limit", list->limit, {1, 1000}, "At most so many");
    list_command.add_option("--label", list->labels, "Only jobs that have it; may be given several times")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    list_command
        .add_option("--state", list->states, "Only jobs in this state, such as failed; may be given several times")
        ->type_name("STATE")
        ->allow_extra_args(false);
    list_command.add_option("--owner", list->owner, "Only this owner's, such as uid:1000")->type_name("OWNER");
    list_command.add_flag("--json", list->json, "Print JSON");
    add_server_arguments(list_command, list->server);
    list_command.footer("Example: rcsplat list --state failed --label shot=sh010 --json");
    list_command.callback([list, &action] { action = [list] { run_list(*list); }; });

    const auto stats = std::make_shared<StatsArguments>();
    CLI::App& stats_command = *app.add_subcommand("stats", "Prints the counters of a server");
    stats_command.add_flag("--prometheus", stats->prometheus, "As Prometheus reads them");
    stats_command.add_flag("--json", stats->json, "Print JSON");
    stats_command
        .add_flag("--health", stats->health,
                  "Say whether the server is well, and end with 1 and the reason if it is not: a full disk, no worker")
        ->excludes("--prometheus");
    add_server_arguments(stats_command, stats->server);
    stats_command.footer("Example: rcsplat stats --prometheus");
    stats_command.callback([stats, &action] { action = [stats] { run_stats(*stats); }; });
}

}  // namespace rcs::service
