#include "cli/run_support.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include "process/interrupt.h"
#include "process/process.h"
#include "rcs/option_table.h"

namespace rcs::service {
namespace {

std::string value_of(const CLI::Option& option)
{
    if (option.get_expected_max() == 0) {
        return option.count() > 0 ? "true" : "false";  // a flag
    }
    if (option.count() == 0) {
        return option.get_default_str();
    }
    std::string joined;
    for (const std::string& value : option.results()) {
        joined.append(joined.empty() ? "" : ",").append(value);
    }
    return joined;
}

bool is_in_table(const std::string& name)
{
    const auto table = option_table();
    return std::any_of(table.begin(), table.end(), [&](const OptionInfo& o) { return o.name == "--" + name; });
}

}  // namespace

RunReport begin_report(const CLI::App& command, const SceneArguments& arguments, const ThreadPool& pool,
                       const RenderOptions* render)
{
    RunReport report;
    report.command = command.get_name();
    report.scene = arguments.scene;
    report.threads = pool.size();
    const Size size = parse_size(arguments.size);
    report.width = size.width;
    report.height = size.height;
    if (render != nullptr) report.options = list_options(*render);
    for (const CLI::Option* option : command.get_options()) {
        const std::string name = option->get_single_name();
        if (name != "help" && (render == nullptr || !is_in_table(name))) {
            report.options.emplace_back(name, value_of(*option));
        }
    }
    return report;
}

Scene load(const SceneArguments& arguments, ProgressBar& bar, RunReport& report)
{
    bar.show("load", 0.0f);
    Scene scene = timed(report, "load", [&] { return load_scene(scene_choice(arguments), bar.log()); });
    stop_if_interrupted();
    return scene;
}

Session begin_session(const SceneArguments& arguments, ProgressBar& bar)
{
    Session session({.threads = arguments.threads, .log = bar.log()});
    limit_gl_threads(session.pool().size());
    return session;
}

const RayScene& build_rays(Session& session, const EffectChoice& effects, ProgressBar& bar, RunReport& report)
{
    bar.show("bvh", 0.0f);
    timed(report, "bvh", [&] { session.rays(effects); });
    stop_if_interrupted();
    return session.rays(effects);
}

void deliver(RunReport& report, const ReportArguments& arguments, std::chrono::steady_clock::time_point begin)
{
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    // A scene may be named in bytes that are no UTF-8; they are replaced, not refused.
    const std::string json =
        to_json(report).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    if (!arguments.stats_file.empty()) {
        write_text_file(arguments.stats_file, json);
    }
    if (arguments.json) {
        std::fputs(json.c_str(), stdout);
    } else if (!arguments.quiet) {
        std::fputs(to_text(report).c_str(), stdout);
    }
}

}  // namespace rcs::service
