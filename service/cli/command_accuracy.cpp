#include "cli/commands.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/arguments.h"
#include "cli/describe.h"
#include "cli/progress_bar.h"
#include "cli/run_support.h"
#include "cli/table_options.h"
#include "process/process.h"
#include "rcs/rcs.h"
#include "report/page.h"
#include "report/paths.h"
#include "report/raster.h"
#include "report/sweep_run.h"
#include "report/table.h"

namespace rcs::service {
namespace {

struct AccuracyArguments {
    SceneArguments scene;
    ReportArguments report;
    RenderOptions options;
    std::string folder;
    std::string points = std::to_string(kMostSweepPoints);
    std::vector<int> path_samples{16, 64, 256, 1024};
    double reference_error = 2.0;  ///< [%]
    int reference_samples = 16384;
    std::string final_size = "1920x1080";
    bool fresh = false;
};

constexpr int kMostSamples = 1 << 20;  // as ReferenceOptions::samples

/// A number of points, or A:RAYS:NOISE for each.
std::vector<SweepPoint> parse_points(const std::string& text, const RenderOptions& base)
{
    const auto refuse = [&](const std::string& why) -> Error { return {ErrorCode::bad_argument, text + " " + why}; };
    if (text.find(':') == text.npos) {
        const bool digits = !text.empty() && text.size() < 4 && text.find_first_not_of("0123456789") == text.npos;
        const int count = digits ? std::stoi(text) : 0;
        if (count < 2 || count > kMostSweepPoints)
            throw refuse("is neither a whole number in [2, " + std::to_string(kMostSweepPoints) +
                         "] nor A:RAYS:NOISE,...");
        return settings_sweep(base, count);
    }
    std::vector<SweepPoint> points;
    for (const std::string& item : CLI::detail::split(text, ',')) {
        float accuracy = 0.0f, noise = 0.0f;
        int rays = 0, used = 0;
        if (std::sscanf(item.c_str(), "%f:%d:%f%n", &accuracy, &rays, &noise, &used) != 3 ||
            static_cast<std::size_t>(used) != item.size())
            throw refuse("has a part " + item + " that is no A:RAYS:NOISE");
        points.push_back(settings_point(base, accuracy, rays, noise));
        try {
            validate(points.back().options);
        } catch (const Error& e) {
            throw refuse(std::string("has a part ") + item + " that is out of range: " + e.what());
        }
    }
    return points;
}

int parse_path_samples(const std::string& text)
{
    const bool digits = !text.empty() && text.size() < 8 && text.find_first_not_of("0123456789") == text.npos;
    const int samples = digits ? std::stoi(text) : 0;
    if (samples > kMostSamples || !is_round(samples))
        throw Error(ErrorCode::bad_argument, text + " is none of 16, 32, 64, 128 and the multiples of 256 up to " +
                                                 std::to_string(kMostSamples));
    return samples;
}

SweepPlan plan_of(const AccuracyArguments& arguments)
{
    RenderOptions base = arguments.options;
    const Size size = parse_size(arguments.scene.size);
    base.width = size.width;
    base.height = size.height;
    validate(base);
    SweepPlan plan;
    plan.cache = arguments.folder + "/rcsplat-cache";
    plan.points = parse_points(arguments.points, base);
    // With settings of the caller's own, those are what is asked for.
    if (arguments.points.find(':') == std::string::npos) {
        for (const int percent : {10, 5, 3}) {
            RenderOptions options = base;
            options.quality = TargetError{0.01 * percent};
            plan.points.push_back({"--target-error " + std::to_string(percent) + "%", options});
        }
    }
    plan.path_samples = arguments.path_samples;
    std::sort(plan.path_samples.begin(), plan.path_samples.end());
    plan.path_samples.erase(std::unique(plan.path_samples.begin(), plan.path_samples.end()), plan.path_samples.end());
    plan.reference = {
        .samples = arguments.reference_samples, .bounces = base.bounces, .aa = base.aa, .seed = base.seed + 1};
    plan.path_seed = base.seed + 3;
    plan.reference_error = 0.01 * arguments.reference_error;
    return plan;
}

void make_folder(const std::string& folder)
{
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw Error(ErrorCode::io, "cannot make the folder " + folder + ": " + error.message());
}

/// The folder and its cache, writable; what an earlier run kept there is taken up unless it is to begin afresh.
void prepare_folders(const AccuracyArguments& arguments, const SweepPlan& plan)
{
    make_folder(arguments.folder);
    check_text_path(arguments.folder + "/index.html");
    if (arguments.fresh) {
        std::error_code error;
        std::filesystem::remove_all(plan.cache, error);
        if (error) throw Error(ErrorCode::io, "cannot remove " + plan.cache + ": " + error.message());
    }
    make_folder(plan.cache);
}

void write_report(const AccuracyArguments& arguments, const AccuracyReport& report)
{
    write_text_file(arguments.folder + "/curve.csv", to_csv(report));
    write_display_image(arguments.folder + "/curve.png", raster(lay_out(plot_of(report))));
    write_text_file(arguments.folder + "/index.html", to_html(report));
    const std::string json =
        to_json(report).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    if (!arguments.report.stats_file.empty()) write_text_file(arguments.report.stats_file, json);
    if (arguments.report.json) {
        std::fputs(json.c_str(), stdout);
    } else if (!arguments.report.quiet) {
        std::printf("%swrote     %s/index.html, curve.png, curve.csv\n", to_text(report).c_str(),
                    arguments.folder.c_str());
    }
}

/// A word as a shell takes it.
std::string quoted(const std::string& word)
{
    const auto plain = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("-_./:,=+%x", c) != nullptr;
    };
    if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

/// The render that has the scene, view and samples of this command; settings and outputs are left to the reader.
std::string render_command(const CLI::App& command)
{
    constexpr std::string_view kOwn[] = {"output",     "points", "path-samples", "reference-error", "reference-spp",
                                         "fresh",      "stats",  "json",         "quiet",           "log-level",
                                         "final-size", "help",   "help-all"};
    std::string text = "rcsplat render " + quoted(command.get_option("scene")->as<std::string>());
    for (const CLI::Option* option : command.get_options()) {
        const std::string name = option->get_single_name();
        const bool always = name == "size" || name == "aa";  // with other defaults than render
        if (option->get_positional() || std::find(std::begin(kOwn), std::end(kOwn), name) != std::end(kOwn)) continue;
        if (option->count() == 0 && !always) continue;
        text +=
            " --" + name + " " + quoted(option->count() > 0 ? option->results().front() : option->get_default_str());
    }
    return text;
}

/// run_sweep(), which says how to go on when it is stopped.
AccuracyReport measured(Session& session, const View& view, const SweepPlan& plan, ProgressBar& bar)
{
    try {
        return run_sweep(session, view, plan, bar.log(), bar.progress());
    } catch (const Error& e) {
        if (e.code() != ErrorCode::cancelled) throw;
        throw Error(ErrorCode::cancelled, "interrupted; what was measured is kept in '" + plan.cache +
                                              "', and the same command goes on from there");
    }
}

void measure_accuracy(const AccuracyArguments& arguments, const CLI::App& command)
{
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    const SweepPlan plan = plan_of(arguments);
    check_plot_font();
    check_text_path(arguments.report.stats_file);

    Session session = begin_session(arguments.scene, bar);
    RunReport run = begin_report(command, arguments.scene, session.pool());
    session.show(load(arguments.scene, bar, run));
    const View view{choose_camera(session.scene(), camera_choice(arguments.scene, arguments.scene.time)), run.width,
                    run.height};
    build_rays(session, EffectChoice{}, bar, run);
    prepare_folders(arguments, plan);
    AccuracyReport report = measured(session, view, plan, bar);
    report.command = render_command(command);
    const Size final_size = parse_size(arguments.final_size);
    report.final_width = final_size.width;
    report.final_height = final_size.height;
    bar.finish();
    report.scene = std::filesystem::path(arguments.scene.scene).filename().string();
    report.camera = view.camera.name;
    write_report(arguments, report);
}

}  // namespace

void add_accuracy_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand(
        "accuracy", "Shows what accuracy costs: renders from coarse to fine against a path traced reference");
    const auto arguments = std::make_shared<AccuracyArguments>();
    RenderOptions& options = arguments->options;
    options.aa = 1;  // renderer and path tracer sample the same pixel centres
    add_scene_arguments(command, arguments->scene, {400, 400});
    command.option_defaults()->group(option_group::kOutput);
    command
        .add_option("-o,--output", arguments->folder,
                    "Folder for index.html, curve.png, curve.csv and what later runs take up; made if missing")
        ->required()
        ->type_name("FOLDER");
    command
        .add_option("--points", arguments->points,
                    "How many settings to measure, in [2, " + std::to_string(kMostSweepPoints) +
                        "], or the settings themselves: accuracy, rays and noise of each")
        ->type_name("N|A:RAYS:NOISE,...")
        ->capture_default_str()
        ->check(
            [](const std::string& text) {
                return check_text([](const std::string& t) { return parse_points(t, {}); }, text);
            },
            "");
    command
        .add_option("--path-samples", arguments->path_samples,
                    "Paths a pixel at which the path tracer is measured: 16, 32, 64, 128 or multiples of 256")
        ->type_name("N,...")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check([](const std::string& text) { return check_text(parse_path_samples, text); }, "");
    add_number(command, "--reference-error", arguments->reference_error, {0, 100, true},
               "Error of its own that the reference is traced to: mean relative error of the indirect light [%]");
    add_number(command, "--reference-spp", arguments->reference_samples, {16, kMostSamples},
               "Paths a pixel that the reference may take at the most");
    OptionInfo bounces = find_option("bounces");
    bounces.range.least = 1.0;  // without any there is no indirect light to measure
    add_number(command, bounces, options.bounces);
    add_number(command, find_option("aa"), options.aa, ", as the path tracer then does: edges are no error");
    add_number(command, find_option("seed"), options.seed);
    command
        .add_option("--final-size", arguments->final_size,
                    "Size of the final picture, for which times are said as well [px]")
        ->type_name("WxH")
        ->check(checked_by(parse_size), "")
        ->capture_default_str();
    command.add_flag("--fresh", arguments->fresh, "Measure all anew instead of taking up what the folder keeps");
    add_report_arguments(command, arguments->report);
    command.footer(
        "Example: rcsplat accuracy sponza.glb --camera atrium -o report/\n"
        "An interrupted run goes on where it stopped when it is started again.");
    command.callback(
        [arguments, &command, &action] { action = [arguments, &command] { measure_accuracy(*arguments, command); }; });
}

}  // namespace rcs::service
