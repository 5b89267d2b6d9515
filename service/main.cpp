#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/advice.h"
#include "cli/batch_description.h"
#include "cli/commands.h"
#include "cli/help.h"
#include "cli/outputs.h"
#include "process/exit_code.h"
#include "process/interrupt.h"
#include "process/printable.h"
#include "process/process.h"
#include "rcs/error.h"
#include "rcs/version.h"
#include "wire/errors.h"

namespace {

using rcs::ErrorCode;

using rcs::service::exit_code;
using rcs::service::kBadUsage;
using rcs::service::kFailed;

int report(const std::string& message, int code)
{
    std::string line = message;
    for (char& c : line) {
        if (c == '\n' || c == '\r') c = ' ';
    }
    const char* kind = code == rcs::service::kWarned ? "warning" : "error";
    std::fprintf(stderr, "rcsplat: %s: %s\n", kind, rcs::service::printable(line).c_str());
    return code;
}

/// Whether stdout took everything: a table lost to a full disk is a failure too.
int flush_results()
{
    const bool ok = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    return ok ? 0 : report("cannot write the results to standard output", kFailed);
}

int run(int argc, char** argv)
{
    CLI::App app("Renders global illumination by radiance cache splatting.", "rcsplat");
    app.formatter(std::make_shared<rcs::service::HelpFormatter>());
    app.set_help_flag("-h,--help", "Say what there is, and stop");
    app.set_help_all_flag("--help-all", "The same with every option");
    app.set_version_flag("--version", std::string("rcsplat ") + rcs::kVersion, "Say the version, and stop");
    app.require_subcommand(1);
    app.footer("rcsplat COMMAND --help lists a command's options.");
    rcs::service::Action action;
    rcs::service::add_render_command(app, action);
    const std::vector<std::string> all_words = rcs::service::with_description({argv + std::min(argc, 1), argv + argc});
    const std::vector<std::string> words{all_words.begin() + (all_words.empty() ? 0 : 1), all_words.end()};
    rcs::service::add_batch_command(app, action, words);
    rcs::service::add_view_command(app, action);
    rcs::service::add_plan_command(app, action);
    rcs::service::add_reference_command(app, action);
    rcs::service::add_compare_command(app, action);
    rcs::service::add_flicker_command(app, action);
    rcs::service::add_accuracy_command(app, action);
    rcs::service::add_serve_command(app, action, words);
    rcs::service::add_submit_command(app, action);
    rcs::service::add_job_commands(app, action);
    rcs::service::add_hold_commands(app, action);
    rcs::service::add_worker_command(app, action);
    rcs::service::add_doctor_command(app, action);
    rcs::service::add_shell_commands(app, action);
    try {
        rcs::service::refuse_short_assignments(all_words);
        app.parse(std::vector<std::string>(all_words.rbegin(), all_words.rend()));  // backwards, as CLI11 wants them
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
            return app.exit(e);  // --help and --version
        }
        return report(rcs::service::advice(app, all_words, e), kBadUsage);
    }
    rcs::service::check_written_files(*app.get_subcommands().front());
    action();
    return flush_results();
}

}  // namespace

int main(int argc, char** argv)
{
    rcs::service::keep_freed_memory();
    rcs::service::install_signal_handlers();
    try {
        return run(argc, argv);
    } catch (const rcs::service::Ended& e) {
        return report(e.what(), e.code());
    } catch (const rcs::Error& e) {
        return report(e.what(), exit_code(e.code()));
    } catch (const rcs::service::ServiceError& e) {
        return report(e.what(), exit_code(e.code()));
    } catch (const std::bad_alloc&) {
        return report("out of memory", exit_code(ErrorCode::out_of_memory));
    } catch (const std::exception& e) {
        return report(std::string("internal error: ") + e.what(), exit_code(ErrorCode::internal));
    }
}
