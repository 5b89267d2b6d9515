#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/describe.h"
#include "cli/parse.h"
#include "cli/server_options.h"
#include "seal/seal.h"
#include "server/server.h"
#include "worker/worker.h"

namespace rcs::service {
namespace {

constexpr const char* kConfigHelp =
    "File with these options, one a line, as in: workers = 2; those of the command line come first";

void add_options(CLI::App& command, ServerConfig& config)
{
    command.set_config("--config", "", kConfigHelp)->type_name("FILE");
    command.allow_config_extras(CLI::config_extras_mode::error);
    add_server_options(command, config);
}

/// Where a configuration file says something of an option: "FILE, line 3: ", or "FILE: ".
std::string place_of(const std::string& file, const std::string& option)
{
    std::ifstream lines(file);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        const std::size_t begin = line.find_first_not_of(" \t");
        if (begin == line.npos || line.compare(begin, option.size(), option) != 0) continue;
        const std::size_t end = begin + option.size();
        if (end == line.size() || line[end] == ' ' || line[end] == '\t' || line[end] == '=')
            return file + ", line " + std::to_string(number) + ": ";
    }
    return file + ": ";
}

/// What is wrong with a configuration file, whose parsing ended in `e`.
[[noreturn]] void refuse_file(const CLI::App& app, const std::string& file, const CLI::ParseError& e)
{
    const std::string what = e.what();
    if (!std::ifstream(file)) throw Error(ErrorCode::not_found, "configuration file '" + file + "' does not exist");
    const std::string_view unknown = "INI was not able to parse ";
    if (what.starts_with(unknown)) {
        const std::string key = what.substr(unknown.size());
        std::vector<std::string> names;
        for (const CLI::Option* option : app.get_options()) names.push_back(option->get_single_name());
        throw Error(ErrorCode::bad_argument, place_of(file, key) + check_name("option", key, names));
    }
    const bool named = what.starts_with("--");  // "--workers: workers is ..."
    const std::string key = named ? what.substr(2, what.find(':') - 2) : "";
    throw Error(ErrorCode::bad_argument, place_of(file, key) + (named ? what.substr(what.find(": ") + 2) : what));
}

/// The options of a command line with its file, as it is now.
ServerConfig read(const std::vector<std::string>& words, const std::string& file)
{
    CLI::App app;
    ServerConfig config;
    bool check = false;
    add_options(app, config);
    app.add_flag("--check", check);
    std::vector<std::string> backwards(words.rbegin(), words.rend());  // as CLI11 wants them
    try {
        app.parse(backwards);
    } catch (const CLI::ParseError& e) {
        refuse_file(app, file, e);  // the words alone have been parsed
    }
    complete(config);
    return config;
}

}  // namespace

void add_serve_command(CLI::App& app, Action& action, const std::vector<std::string>& words)
{
    CLI::App& command =
        *app.add_subcommand("serve", "Renders jobs that clients submit, one after the other, until it is told to stop");
    // Parsed twice: its configuration file is read then, and again while it runs.
    struct Shown {
        ServerConfig config;
        std::string file;
        bool check = false;
    };
    const auto shown = std::make_shared<Shown>();
    command.option_defaults()->group(option_group::kServe);
    command.add_option("--config", shown->file, kConfigHelp)->type_name("FILE");
    add_server_options(command, shown->config);
    command.option_defaults()->group(option_group::kServe);
    command.add_flag("--check", shown->check, "Say whether the configuration is valid, and stop");
    command.footer(
        "SIGTERM stops it, SIGHUP lets it read the configuration again.\n"
        "Example: rcsplat serve --state /var/lib/rcsplat --root /scenes --http 127.0.0.1:8080");
    command.callback([shown, words, &action] {
        action = [shown, words] {
            const ServerConfig config = read(words, shown->file);
            if (shown->check) {
                std::puts("the configuration is valid");
                std::printf("workers are kept from: %s\n", describe(available_seal()).c_str());
                return;
            }
            serve(config, [words, shown] { return read(words, shown->file); });
        };
    });
}

void add_worker_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand("worker", "Renders for a server that started it");
    command.group("");  // not for people
    const auto arguments = std::make_shared<WorkerArguments>();
    command.add_option("--in", arguments->in)->required();
    command.add_option("--out", arguments->out)->required();
    command.add_flag("--elsewhere", arguments->elsewhere);
    command.add_option("--threads", arguments->threads);
    command.add_option("--state", arguments->state)->required();
    command.add_option("--home", arguments->home)->required();
    command.add_option("--root", arguments->roots)->allow_extra_args(false);
    command.callback([arguments, &action] { action = [arguments] { run_worker(*arguments); }; });
}

}  // namespace rcs::service
