#include "cli/remote_render.h"

#include <cstdio>

#include <nlohmann/json.hpp>

#include "cli/job_run.h"
#include "output/stats_json.h"
#include "process/interrupt.h"
#include "rcs/error.h"
#include "rcs/image_io.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

std::string summary(const nlohmann::ordered_json& stats, const std::vector<std::string>& files)
{
    char line[160];
    std::snprintf(line, sizeof line, "%s, camera \"%s\", %dx%d, on a server with %d threads\n",
                  stats.value("scene", "").c_str(), stats.value("camera", "").c_str(), stats.value("width", 0),
                  stats.value("height", 0), stats.value("threads", 0));
    std::string text = line;
    std::snprintf(line, sizeof line, "\n%-12s %9s\n", "stage", "seconds");
    text += line;
    for (const auto& [stage, seconds] : stats.at("stage_seconds").items()) {
        std::snprintf(line, sizeof line, "%-12s %9.3f\n", stage.c_str(), seconds.get<double>());
        text += line;
    }
    const auto& errors = stats.at("error_estimate");
    const auto percent = [&](const char* of) { return 100.0 * errors.at(of).value("mean_relative", 0.0); };
    std::snprintf(line, sizeof line,
                  "%-12s %9.3f\n\nerror    the picture is off by about %.1f %%, its indirect light by %.1f %%, in the "
                  "mean\n",
                  "all", stats.value("seconds", 0.0), percent("image"), percent("indirect"));
    text += line;
    for (const std::string& file : files) text += "wrote    " + file + "\n";
    return text;
}

}  // namespace

void render_on_server(const RenderArguments& arguments, const Shutter& shutter, const ServerArguments& server)
{
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    RequestedJob requested = request_job(arguments, shutter, false);
    *requested.job.add_frames() = request_frame(arguments, 0, arguments.scene.time);
    for (const std::string& path : requested.paths) check_output_path(path, {});
    check_text_path(arguments.report.stats_file);
    Client client = connect(server, Patience::of_a_waiting_client);
    const std::uint64_t job = submit(client, requested, bar).job();
    try {
        const v1::JobStatus end = follow(client, job, bar);
        if (end.state() == v1::JOB_STATE_CANCELLED)
            throw ServiceError(v1::ERROR_CODE_CANCELLED, "job " + std::to_string(job) + " was cancelled");
        if (end.state() == v1::JOB_STATE_FAILED) throw ServiceError(end.error().code(), end.error().message());
    } catch (const Error& e) {
        if (e.code() != ErrorCode::cancelled) throw;
        connect(server, Patience::none_and_no_interrupt)
            .cancel(job);  // the signal has come already: this is not to end by it
        throw Error(ErrorCode::cancelled, "interrupted, nothing was written");
    }
    const v1::JobReply details = client.details(job, 0, 1);
    for (const std::string& warning : details.frames(0).warnings()) bar.log()(LogLevel::warning, warning);
    for (int i = 0; i < requested.job.outputs_size(); ++i) {
        client.fetch(job, 0, requested.job.outputs(i).name(), requested.paths[static_cast<std::size_t>(i)]);
    }
    auto stats = nlohmann::ordered_json::parse(details.frames(0).stats_json());
    stats["images"] = requested.paths;
    if (!arguments.report.stats_file.empty()) write_text_file(arguments.report.stats_file, stats.dump(2) + "\n");
    if (arguments.report.json) {
        std::printf("%s\n", stats.dump(2).c_str());
    } else if (!arguments.report.quiet) {
        std::fputs(summary(stats, requested.paths).c_str(), stdout);
    }
}

}  // namespace rcs::service
