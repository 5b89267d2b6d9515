#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/server_options.h"
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

/// The options of a command line with its file read anew.
ServerConfig read_again(const std::vector<std::string>& words)
{
    CLI::App app;
    ServerConfig config;
    bool check = false;
    add_options(app, config);
    app.add_flag("--check", check);
    std::vector<std::string> backwards(words.rbegin(), words.rend());  // as CLI11 wants them
    app.parse(backwards);
    complete(config);
    return config;
}

}  // namespace

void add_serve_command(CLI::App& app, Action& action, const std::vector<std::string>& words)
{
    CLI::App& command =
        *app.add_subcommand("serve", "Renders jobs that clients submit, one after the other, until it is told to stop");
    command.prefix_command();
    command.set_help_flag();
    command.callback([&action, words] {
        // Parsed apart: its configuration file is read again while it runs.
        struct Parsed {
            CLI::App app{"Renders jobs that clients submit, until SIGTERM; SIGHUP reads the configuration again.",
                         "rcsplat serve"};
            ServerConfig config;
            bool check = false;
        };
        const auto parsed = std::make_shared<Parsed>();
        add_options(parsed->app, parsed->config);
        parsed->app.add_flag("--check", parsed->check, "Say whether the configuration is valid, and stop");
        parsed->app.footer("Example: rcsplat serve --state /var/lib/rcsplat --root /scenes --http 127.0.0.1:8080");
        std::vector<std::string> backwards(words.rbegin(), words.rend());
        try {
            parsed->app.parse(backwards);
        } catch (const CLI::CallForHelp&) {
            action = [parsed] { std::fputs(parsed->app.help().c_str(), stdout); };
            return;
        }
        action = [parsed, words] {
            complete(parsed->config);
            if (parsed->check) {
                std::puts("the configuration is valid");
                return;
            }
            serve(parsed->config, [words] { return read_again(words); });
        };
    });
}

void add_worker_command(CLI::App& app, Action& action)
{
    CLI::App& command = *app.add_subcommand("worker", "Renders for a server that started it");
    command.group("");  // not for people
    struct Arguments {
        int fd = -1, threads = 0;
    };
    const auto arguments = std::make_shared<Arguments>();
    command.add_option("--fd", arguments->fd)->required();
    command.add_option("--threads", arguments->threads);
    command.callback([arguments, &action] { action = [arguments] { run_worker(arguments->fd, arguments->threads); }; });
}

}  // namespace rcs::service
