#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace rcs::service {

/// What the chosen subcommand will do; set while the command line is parsed, called once it is valid.
using Action = std::function<void()>;

void add_render_command(CLI::App& app, Action& action);
/// @param words  of the command line after "batch"
void add_batch_command(CLI::App& app, Action& action, const std::vector<std::string>& words);
void add_plan_command(CLI::App& app, Action& action);
void add_reference_command(CLI::App& app, Action& action);
void add_compare_command(CLI::App& app, Action& action);
void add_flicker_command(CLI::App& app, Action& action);
void add_accuracy_command(CLI::App& app, Action& action);
/// @param words  of the command line after "serve"
void add_serve_command(CLI::App& app, Action& action, const std::vector<std::string>& words);
void add_worker_command(CLI::App& app, Action& action);
void add_submit_command(CLI::App& app, Action& action);
void add_job_commands(CLI::App& app, Action& action);    ///< watch, fetch, cancel, list, stats
void add_hold_commands(CLI::App& app, Action& action);   ///< retry, pause, resume, priority, logs
void add_shell_commands(CLI::App& app, Action& action);  ///< completion, manual
void add_doctor_command(CLI::App& app, Action& action);
void add_view_command(CLI::App& app, Action& action);

}  // namespace rcs::service
