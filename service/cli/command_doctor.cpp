#include "cli/commands.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/describe.h"
#include "cli/machine_report.h"
#include "cli/progress_bar.h"
#include "cli/run_support.h"
#include "cli/table_options.h"
#include "process/interrupt.h"
#include "process/process.h"
#include "rcs/rcs.h"

namespace rcs::service {
namespace {

struct DoctorArguments {
    SceneArguments scene;  ///< only --threads, and with --scene what it takes to load one
    std::vector<std::string> cases;
    std::string save;
    std::string log_level = "warning";
    OptionTexts options;  ///< only --gather and --device
    bool quick = false, json = false, list = false;
};

/// A case with what came of it.
struct Row {
    StabilityCase says;
    StabilityOutcome outcome;
};

const char* word_of(StabilityVerdict verdict)
{
    switch (verdict) {
        case StabilityVerdict::passed:
            return "pass";
        case StabilityVerdict::failed:
            return "FAIL";
        case StabilityVerdict::skipped:
            return "skip";
    }
    return "";
}

std::vector<StabilityCase> chosen_cases(const DoctorArguments& arguments)
{
    const std::vector<StabilityCase>& all = arguments.scene.scene.empty() ? stability_cases() : metamorphic_cases();
    std::vector<StabilityCase> chosen;
    for (const std::string& id : arguments.cases)
        if (std::none_of(all.begin(), all.end(), [&](const StabilityCase& c) { return c.id == id; })) {
            std::string names;
            for (const StabilityCase& c : all) names.append(names.empty() ? "" : ", ").append(c.id);
            throw Error(ErrorCode::bad_argument, "--case: there is no case " + id + "; there are " + names);
        }
    for (const StabilityCase& c : all)
        if (arguments.cases.empty()
                ? c.quick || !arguments.quick
                : std::find(arguments.cases.begin(), arguments.cases.end(), c.id) != arguments.cases.end())
            chosen.push_back(c);
    return chosen;
}

/// One line a case: the table of the docs as well.
std::string line_of(const Row& row)
{
    char numbers[96];
    std::snprintf(numbers, sizeof numbers, "%s  %-9s %9.2g %9.2g %6.1f s  ", word_of(row.outcome.verdict),
                  row.says.id.c_str(), row.outcome.figure, row.says.tolerance, row.outcome.seconds);
    std::string line = numbers + row.says.name + "\n";
    line += "      expected  " + row.says.expectation + "\n";
    line += "      measured  " + row.outcome.measured + "\n";
    if (row.outcome.verdict == StabilityVerdict::failed) line += "      breaks    " + row.says.hazard + "\n";
    if (!row.outcome.saved.empty()) line += "      saved     " + row.outcome.saved + "\n";
    return line;
}

nlohmann::ordered_json json_of(const Row& row)
{
    return {{"id", row.says.id},
            {"group", row.says.group},
            {"name", row.says.name},
            {"hazard", row.says.hazard},
            {"expectation", row.says.expectation},
            {"tolerance", row.says.tolerance},
            {"reason", row.says.reason},
            {"verdict", word_of(row.outcome.verdict)},
            {"figure", std::isfinite(row.outcome.figure) ? nlohmann::ordered_json(row.outcome.figure)
                                                         : nlohmann::ordered_json(nullptr)},
            {"measured", row.outcome.measured},
            {"seconds", row.outcome.seconds},
            {"saved", row.outcome.saved}};
}

/// How a user's scene is rendered: small, but with few enough other errors for a mean to be compared.
RenderOptions metamorphic_options(const SceneArguments& arguments)
{
    RenderOptions options;
    const Size size = parse_size(arguments.size);
    options.width = size.width;
    options.height = size.height;
    options.aa = 1;
    settings_of(options).rays = 512;
    settings_of(options).noise_target = 0.01f;
    options.area_samples = options.penumbra_samples = 64;
    return options;
}

void print_machine(const MachineReport& report)
{
    for (const auto& [name, value] : report) std::printf("%-26s %s\n", name.c_str(), value.c_str());
    std::printf("\nverdict case       figure   at most    time  what\n");
    std::fflush(stdout);
}

void list_cases(const std::vector<StabilityCase>& cases)
{
    for (const StabilityCase& c : cases)
        std::printf("%-10s %s%s\n           breaks: %s\n           expected: %s, to %g (%s)\n", c.id.c_str(),
                    c.name.c_str(), c.quick ? "" : " (not with --quick)", c.hazard.c_str(), c.expectation.c_str(),
                    c.tolerance, c.reason.c_str());
}

void examine(const DoctorArguments& arguments)
{
    const std::vector<StabilityCase> cases = chosen_cases(arguments);
    if (arguments.list) return list_cases(cases);
    if (!arguments.save.empty()) std::filesystem::create_directories(arguments.save);
    const auto begin = std::chrono::steady_clock::now();
    ProgressBar bar(parse_log_level(arguments.log_level), arguments.json);
    ThreadPool pool(arguments.scene.threads);
    limit_gl_threads(pool.size());
    const RenderOptions options = read_options(arguments.options, {});
    GlContext gl(options.device, bar.log());
    const StabilityMachine machine{gl, pool, "/proc/self/exe", arguments.save, options.gather};
    const MachineReport report = describe_machine(gl, pool, bar.log());
    Scene scene;
    Camera camera;
    if (!arguments.scene.scene.empty()) {
        RunReport unused;
        scene = load(arguments.scene, bar, unused);
        camera = choose_camera(scene, camera_choice(arguments.scene, arguments.scene.time));
    }
    bar.finish();
    if (!arguments.json) print_machine(report);
    std::vector<Row> rows;
    for (const StabilityCase& c : cases) {
        rows.push_back({c, arguments.scene.scene.empty() ? run_stability_case(machine, c.id)
                                                         : run_metamorphic_case(machine, c.id, scene, camera,
                                                                                metamorphic_options(arguments.scene))});
        stop_if_interrupted();
        if (!arguments.json) {
            std::fputs(line_of(rows.back()).c_str(), stdout);
            std::fflush(stdout);
        }
    }
    const auto count = [&](StabilityVerdict verdict) {
        return std::count_if(rows.begin(), rows.end(), [&](const Row& row) { return row.outcome.verdict == verdict; });
    };
    const auto failed = count(StabilityVerdict::failed), skipped = count(StabilityVerdict::skipped);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (arguments.json) {
        nlohmann::ordered_json json = {{"version", kVersion},
                                       {"command", "doctor"},
                                       {"scene", arguments.scene.scene},
                                       {"seconds", seconds},
                                       {"machine", nlohmann::ordered_json::object()},
                                       {"cases", nlohmann::ordered_json::array()}};
        for (const auto& [name, value] : report) json["machine"][name] = value;
        for (const Row& row : rows) json["cases"].push_back(json_of(row));
        std::puts(json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    } else {
        std::printf("\n%zu cases, %td failed, %td skipped, %.0f s\n", rows.size(), failed, skipped, seconds);
    }
    std::fflush(stdout);
    if (failed > 0)
        throw Error(ErrorCode::internal,
                    std::to_string(failed) + " of " + std::to_string(rows.size()) + " cases failed");
}

}  // namespace

void add_doctor_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand(
        "doctor", "Says what this machine renders with, and whether hard cases come out right on it");
    const auto arguments = std::make_shared<DoctorArguments>();
    add_scene_arguments(command, arguments->scene, {160, 120});
    command.remove_option(command.get_option("scene"));
    command.option_defaults()->group(option_group::kOutput);
    command
        .add_option("--scene", arguments->scene.scene,
                    "A scene of your own: it is scaled, moved, turned, relit, reordered, and has to look the same")
        ->type_name("SCENE");
    command.add_flag("--quick", arguments->quick, "Only cases that take less than half a minute together");
    command.add_option("--case", arguments->cases, "Only this case, may be given several times")
        ->type_name("ID")
        ->allow_extra_args(false);
    for (const char* key : {"gather", "device"})
        add_table_option(command, find_option(key), {}, arguments->options)->group(option_group::kOutput);
    command
        .add_option("--save", arguments->save,
                    "Folder to write a reproducer of each failing case to: scene, pictures, command")
        ->type_name("DIR");
    command.add_flag("--list", arguments->list, "Say what the cases are, and run none");
    command.add_flag("--json", arguments->json, "Print machine and cases as JSON instead of the table");
    command.add_option("--log-level", arguments->log_level, "Least important messages to show")
        ->type_name("debug|info|warning")
        ->check([](const std::string& text) { return check_text(parse_log_level, text); }, "")
        ->capture_default_str();
    // Of no use without a scene to load.
    for (const char* option :
         {"--camera", "--eye", "--camera-path", "--time", "--size", "--environment", "--environment-rotation"})
        command.get_option(option)->needs(command.get_option("--scene"));
    command.footer("Ends with 0 only if every case passes.\nExample: rcsplat doctor --quick");
    command.callback([arguments, &action] { action = [arguments] { examine(*arguments); }; });
}

}  // namespace rcs::service
