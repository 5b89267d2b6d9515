#include "cli/commands.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/describe.h"
#include "cli/memory_need.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "cli/remote_render.h"
#include "cli/render_arguments.h"
#include "cli/run_support.h"
#include "cli/shutter.h"
#include "process/process.h"
#include "rcs/rcs.h"

namespace rcs::service {
namespace {

/// About what writing the pictures takes, for a budget to leave [s]: measured on two cores (docs/accuracy.md).
double writing_seconds(const std::vector<std::string>& files, const RenderOptions& options)
{
    const double megapixels =
        1e-6 * (options.crop ? options.crop->width * options.crop->height : options.width * options.height);
    double seconds = 0.0;
    for (const std::string& file : files) {
        seconds += megapixels * (file.ends_with(".exr") ? 0.75 : 0.25);
    }
    return seconds;
}

constexpr double kRoundedUp = 1.1;  ///< a budget that is missed by less is met

std::string one_digit(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.1f", value);
    return text;
}

std::string to_text(const Forecast& forecast)
{
    std::string text = "\nerror of indirect light   seconds in all\n";
    char line[128];
    for (const Forecast::Point& point : forecast.points) {
        std::snprintf(line, sizeof line, "%20.0f %%   %14.1f\n", 100.0 * point.error, point.seconds);
        text += line;
    }
    std::snprintf(line, sizeof line, "aims at %.1f %%, which takes %.1f s with %d sample%s a pixel\n\n",
                  100.0 * forecast.goal_error, forecast.goal_seconds, forecast.passes, forecast.passes == 1 ? "" : "s");
    return text + line;
}

/// Records that a file holds from one render to the next; nothing without a file.
class KeptRecords {
public:
    /// @throws rcs::Error that names the file: before any work if it could not be written
    explicit KeptRecords(std::string file) : file_(std::move(file))
    {
        if (!file_.empty()) check_record_path(file_);
    }

    void load(Session& session, const RenderOptions& options, RunReport& report)
    {
        if (file_.empty()) return;
        timed(report, "read records", [&] {
            key_ = record_key(session.scene(), options);
            std::error_code ignored;
            std::vector<Record> records;
            if (std::filesystem::exists(file_, ignored)) records = read_records(file_, key_);
            report.record_file = {file_, records.size(), 0};
            session.begin_with(std::move(records));
        });
    }

    /// Leaves a file to which nothing was added as it is.
    void save(const RenderResult& result, RunReport& report) const
    {
        if (file_.empty()) return;
        std::error_code ignored;
        if (result.stats.records.records > 0 || !std::filesystem::exists(file_, ignored)) {
            timed(report, "write records", [&] { write_records(file_, key_, result.records); });
        }
        report.record_file->saved = result.records.size();
    }

private:
    std::string file_;
    RecordKey key_;
};

void take_stages(const RenderStats& stats, RunReport& report)
{
    for (const auto& [stage, seconds] : stats.stage_seconds) report.add(stage, seconds);
}

/// Ends a dry run.
void tell_cost(RenderStats stats, const RenderArguments& arguments, RunReport& report, ProgressBar& bar,
               std::chrono::steady_clock::time_point begin)
{
    bar.finish();
    take_stages(stats, report);
    if (!report.forecast && !arguments.report.quiet && !arguments.report.json)
        std::puts("there is no indirect light to forecast the error of");
    report.render = std::move(stats);
    if (!arguments.report.stats_file.empty() || arguments.report.json) deliver(report, arguments.report, begin);
}

/// @param camera  of a picture without motion blur
RenderResult render_exposed(Session& session, const RenderArguments& arguments, const Shutter& shutter,
                            const Camera& camera, const RenderOptions& options, const RenderHooks& hooks)
{
    const CameraSource source(arguments.scene);
    const auto moments = [&] { return moments_of(arguments.scene, source, session, shutter, *arguments.scene.time); };
    RenderResult result =
        shutter.blurs() ? render(session, moments(), options, hooks) : render(session, camera, options, hooks);
    result.image.metadata["rcs:scene"] = arguments.scene.scene;
    result.image.metadata["rcs:environment"] = arguments.scene.environment;
    return result;
}

void render_scene(const RenderArguments& arguments, const Shutter& shutter, const std::string& record_file,
                  const CLI::App& command)
{
    const auto begin = std::chrono::steady_clock::now();
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    RenderOptions options = final_options(arguments);
    const OutputFiles outputs = output_files(parse_outputs(arguments.output, PixelFormat::half_float),
                                             parse_tone_map(arguments.output), bar.log());
    check_text_path(arguments.report.stats_file);
    KeptRecords kept(record_file);
    check_memory(options, arguments.output.files, bar.log());
    const CameraChoice looked_through = camera_choice(arguments.scene, arguments.scene.time);

    Session session = begin_session(arguments.scene, bar);
    RunReport report = begin_report(command, arguments.scene, session.pool(), &options);
    session.show(load(arguments.scene, bar, report));
    const Camera camera = choose_camera(session.scene(), looked_through);
    report.camera = camera.name;
    options.motion = motion_from(arguments, session.scene());
    kept.load(session, options, report);
    build_rays(session, options.effects, bar, report);
    timed(report, "gl", [&] { session.gl(); });

    // What comes before and after render() counts as well.
    const double around = seconds_of_process() + writing_seconds(arguments.output.files, options);
    const double asked_seconds = budget_seconds(options);
    if (Budget* budget = std::get_if<Budget>(&options.quality))
        budget->seconds = std::max(1e-3, budget->seconds - around);
    const auto tell_forecast = [&](Forecast forecast) {
        for (Forecast::Point& point : forecast.points) {
            point.seconds += around;
        }
        forecast.goal_seconds += around;
        report.forecast = forecast;
        if (asked_seconds > 0.0 && forecast.goal_seconds > kRoundedUp * asked_seconds) {
            bar.log()(LogLevel::warning, "the budget of " + number_text(asked_seconds) +
                                             " s cannot be met: this view takes about " +
                                             one_digit(forecast.goal_seconds) + " s at the least");
        }
        if (!arguments.report.quiet && !arguments.report.json) {
            bar.finish();
            std::fputs(to_text(forecast).c_str(), stdout);
            std::fflush(stdout);
        }
    };
    const RenderHooks hooks{bar.log(), bar.progress(), tell_forecast, {}};
    if (arguments.dry_run) return tell_cost(forecast(session, camera, options, hooks), arguments, report, bar, begin);
    RenderResult result = render_exposed(session, arguments, shutter, camera, options, hooks);
    take_stages(result.stats, report);
    outputs.write(result.image, session.pool(), bar.progress(), report);
    kept.save(result, report);
    bar.finish();
    report.render = std::move(result.stats);
    const double took = seconds_of_process();
    if (asked_seconds > 0.0 && took > kRoundedUp * asked_seconds)
        bar.log()(LogLevel::warning,
                  "it took " + one_digit(took) + " s, more than the budget of " + number_text(asked_seconds) + " s");
    deliver(report, arguments.report, begin);
}

}  // namespace

void add_render_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand("render", "Renders one view of a scene");
    const auto arguments = std::make_shared<RenderArguments>();
    const auto server = std::make_shared<ServerArguments>();
    const auto record_file = std::make_shared<std::string>();
    const auto shutter = std::make_shared<Shutter>();
    add_render_arguments(command, *arguments);
    command.option_defaults()->group(option_group::kRecords);
    command
        .add_option("--records", *record_file,
                    "Start from the records in this file, if there is one, and save them there with those this view "
                    "adds: other views of "
                    "the scene need not gather them again")
        ->type_name("FILE")
        ->excludes("--dry-run");
    command.option_defaults()->group(option_group::kRecords);
    add_shutter(command, *shutter);
    add_fps(command, shutter->fps, "Frames a second that --shutter is a part of");
    command.get_option("--shutter")->excludes("--records")->needs("--time");
    command.get_option("--fps")->needs("--shutter");
    add_server_arguments(command, *server);
    command.get_option("--server")
        ->envname("")
        ->default_str("")
        ->description("Let this render server do it: a socket or HOST:PORT");
    for (const char* local : {"--threads", "--dry-run", "--records", "--asset-root"})
        command.get_option("--server")->excludes(local);
    command.footer("Example: rcsplat render sponza.glb --camera atrium --size 1000x1000 -o sponza.png -o sponza.exr");
    command.callback([arguments, server, record_file, shutter, &command, &action] {
        if (arguments->output.files.empty() && !arguments->dry_run) {
            throw CLI::RequiredError("--output");
        }
        const bool remote = command.get_option("--server")->count() > 0;
        action = [arguments, server, record_file, shutter, remote, &command] {
            remote ? render_on_server(*arguments, *shutter, *server)
                   : render_scene(*arguments, *shutter, *record_file, command);
        };
    });
}

}  // namespace rcs::service
