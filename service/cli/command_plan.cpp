#include "cli/commands.h"

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/describe.h"
#include "cli/progress_bar.h"
#include "cli/render_arguments.h"
#include "cli/run_support.h"
#include "output/plan_json.h"
#include "rcs/rcs.h"

namespace rcs::service {
namespace {

std::string text_of(const std::vector<AnimationInfo>& animations)
{
    std::string text;
    for (std::size_t i = 0; i < animations.size(); ++i)
        text += "animation " + std::to_string(i) + " " + (animations[i].name.empty() ? "" : animations[i].name + " ") +
                "of " + number_text(animations[i].seconds) + " s\n";
    return text;
}

void print_plan(const RenderArguments& arguments, const CLI::App& command)
{
    ProgressBar bar(parse_log_level(arguments.report.log_level), arguments.report.quiet);
    const RenderOptions options = final_options(arguments);
    check_text_path(arguments.report.stats_file);
    Session session = begin_session(arguments.scene, bar);
    RunReport report = begin_report(command, arguments.scene, session.pool(), &options);
    session.show(load(arguments.scene, bar, report));
    const Camera camera = choose_camera(session.scene(), camera_choice(arguments.scene, arguments.scene.time));
    const RayScene& rays = build_rays(session, options.effects, bar, report);
    const EffectPlan plan = timed(report, "plan", [&] { return plan_effects(rays, camera, options); });
    bar.finish();
    nlohmann::ordered_json json = {{"version", kVersion},
                                   {"command", "plan"},
                                   {"scene", arguments.scene.scene},
                                   {"camera", camera.name},
                                   {"seconds", report.stage_seconds.back().second},
                                   {"plan", to_json(plan)}};
    const std::vector<AnimationInfo> animations = list_animations(arguments.scene.scene);
    json["animations"] = nlohmann::ordered_json::array();
    for (const AnimationInfo& a : animations) json["animations"].push_back({{"name", a.name}, {"seconds", a.seconds}});
    const std::string text = json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    if (!arguments.report.stats_file.empty()) {
        write_text_file(arguments.report.stats_file, text);
    }
    if (arguments.report.json) {
        std::fputs(text.c_str(), stdout);
    } else if (!arguments.report.quiet) {
        std::fputs((to_text(plan) + text_of(animations)).c_str(), stdout);
    }
}

/// Whether an option of a render says something about what is simulated, or how it is told.
bool is_of_use(const CLI::Option& option)
{
    const std::string& group = option.get_group();
    const std::string& name = option.get_single_name();
    const bool of_layers = name == "layers" || name == "output";
    return group == option_group::kView || group == option_group::kCamera || group == option_group::kEffects ||
           group == option_group::kQuality || group == option_group::kMachine || group == "Options" || of_layers ||
           name == "stats" || name == "json" || name == "quiet";
}

}  // namespace

void add_plan_command(CLI::App& app, Action& action)
{
    CLI::App& command =
        *app.add_subcommand("plan", "Says which effects a render of this view simulates, which not, and why");
    const auto arguments = std::make_shared<RenderArguments>();
    add_render_arguments(command, *arguments);
    // The rest of a render's options may stay on the command line; it says nothing to a plan.
    for (CLI::Option* option : command.get_options())
        if (!is_of_use(*option)) option->group("");
    command.footer(
        "Other options of render are taken, and change nothing: nothing is drawn or written to --output.\n"
        "Example: rcsplat plan sponza.glb --camera atrium");
    command.callback(
        [arguments, &command, &action] { action = [arguments, &command] { print_plan(*arguments, command); }; });
}

}  // namespace rcs::service
