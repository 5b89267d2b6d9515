// completion and manual: what the program knows of its own command line, for shells and man(1).
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/completion.h"
#include "cli/manual.h"
#include "cli/parse.h"

namespace rcs::service {
namespace {

struct ManualArguments {
    std::string command;
    bool markdown = false;
};

void print_manual(const CommandText& program, const ManualArguments& arguments)
{
    std::string page = arguments.markdown ? commands_page(program) : manual_page(program);
    std::vector<std::string> names;
    for (const CommandText& command : program.commands) {
        names.push_back(command.name.substr(command.name.rfind(' ') + 1));
        if (names.back() == arguments.command) page = manual_page(command);
    }
    if (!arguments.command.empty()) {
        const std::string wrong = check_name("command", arguments.command, names);
        if (!wrong.empty()) throw Error(ErrorCode::bad_argument, wrong);
    }
    std::fputs(page.c_str(), stdout);
}

}  // namespace

void add_shell_commands(CLI::App& app, Action& action)
{
    CLI::App& completion = *app.add_subcommand("completion", "Prints a script that completes command lines in a shell");
    const auto shell = std::make_shared<std::string>();
    completion.add_option("shell", *shell, "The shell")
        ->required()
        ->type_name("bash|zsh|fish")
        ->check([](const std::string& name) { return check_name("shell", name, {"bash", "zsh", "fish"}); }, "");
    completion.footer("Example: source <(rcsplat completion bash)");
    completion.callback([shell, &app, &action] {
        action = [shell, &app] {
            std::fputs(completion_script(describe(app, app.get_name()), *shell).c_str(), stdout);
        };
    });

    CLI::App& manual = *app.add_subcommand("manual", "Prints a manual page, of the program or of a command");
    const auto arguments = std::make_shared<ManualArguments>();
    manual.add_option("command", arguments->command, "The command; default: the program itself")->type_name("COMMAND");
    manual.add_flag("--markdown", arguments->markdown, "All commands on one page, as the documentation has them");
    manual.footer("Example: rcsplat manual render | man -l -");
    manual.callback([arguments, &app, &action] {
        action = [arguments, &app] { print_manual(describe(app, app.get_name()), *arguments); };
    });
}

}  // namespace rcs::service
