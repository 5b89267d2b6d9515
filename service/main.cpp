#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/outputs.h"
#include "process/exit_code.h"
#include "process/interrupt.h"
#include "process/printable.h"
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

/// CLI11 says no more than that a subcommand is missing; this says which word is none.
std::optional<std::string> unknown_command(CLI::App& app, int argc, char** argv)
{
    if (argc < 2 || argv[1][0] == '-') {
        return std::nullopt;
    }
    const std::string word = argv[1];
    std::string names;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (command->get_name() == word) {
            return std::nullopt;
        }
        if (!command->get_group().empty()) names.append(names.empty() ? "" : ", ").append(command->get_name());
    }
    return "there is no command " + word + "; there are " + names;
}

int run(int argc, char** argv)
{
    CLI::App app("Renders global illumination by radiance cache splatting.", "rcsplat");
    app.set_version_flag("--version", std::string("rcsplat ") + rcs::kVersion);
    app.require_subcommand(1);
    app.footer("rcsplat COMMAND --help lists a command's options.");
    rcs::service::Action action;
    rcs::service::add_render_command(app, action);
    const std::vector<std::string> words{argv + std::min(argc, 2), argv + argc};
    rcs::service::add_batch_command(app, action, words);
    rcs::service::add_plan_command(app, action);
    rcs::service::add_reference_command(app, action);
    rcs::service::add_compare_command(app, action);
    rcs::service::add_flicker_command(app, action);
    rcs::service::add_accuracy_command(app, action);
    rcs::service::add_serve_command(app, action, words);
    rcs::service::add_submit_command(app, action);
    rcs::service::add_job_commands(app, action);
    rcs::service::add_worker_command(app, action);
    rcs::service::add_doctor_command(app, action);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
            return app.exit(e);  // --help and --version
        }
        return report(unknown_command(app, argc, argv).value_or(e.what()), kBadUsage);
    }
    rcs::service::check_written_files(*app.get_subcommands().front());
    action();
    return flush_results();
}

}  // namespace

int main(int argc, char** argv)
{
    rcs::service::install_signal_handlers();
    try {
        return run(argc, argv);
    } catch (const rcs::service::Ended& e) {
        return report(e.what(), e.code());
    } catch (const rcs::Error& e) {
        return report(e.what(), exit_code(e.code()));
    } catch (const rcs::service::ServiceError& e) {
        return report(e.what(), exit_code(rcs::service::from_wire(e.code())));
    } catch (const std::bad_alloc&) {
        return report("out of memory", exit_code(ErrorCode::out_of_memory));
    } catch (const std::exception& e) {
        return report(std::string("internal error: ") + e.what(), exit_code(ErrorCode::internal));
    }
}
