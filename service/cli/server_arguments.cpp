#include "cli/server_arguments.h"

#include <cstdio>

#include "cli/describe.h"
#include "process/interrupt.h"
#include "process/printable.h"
#include "rcs/error.h"
#include "wire/address.h"
#include "wire/files.h"

namespace rcs::service {

void add_server_arguments(CLI::App& command, ServerArguments& arguments)
{
    arguments.address = default_socket();
    command.option_defaults()->group(option_group::kServer);
    command
        .add_option("--server", arguments.address,
                    "A render server's socket, or its HOST:PORT; $RCSPLAT_SERVER says another default")
        ->type_name("ADDRESS")
        ->envname("RCSPLAT_SERVER")
        ->capture_default_str();
    command
        .add_option("--token-file", arguments.token_file,
                    "Holds the token that a server wants over TCP; default: $RCSPLAT_TOKEN_FILE")
        ->type_name("FILE")
        ->envname("RCSPLAT_TOKEN_FILE");
    command.add_option("--tls-ca", arguments.ca, "Authority of the server's certificate [PEM]; default: the system's")
        ->type_name("FILE");
    command.add_option("--tls-certificate", arguments.certificate, "Certificate to show instead of a token [PEM]")
        ->type_name("FILE");
    command.add_option("--tls-key", arguments.key, "Its key [PEM]")->type_name("FILE");
    command.get_option("--tls-certificate")->needs("--tls-key");
    command.get_option("--tls-key")->needs("--tls-certificate");
}

Client connect(const ServerArguments& arguments, Patience patience)
{
    ClientOptions options;
    options.ca = arguments.ca;
    options.certificate = arguments.certificate;
    options.key = arguments.key;
    if (patience != Patience::none_and_no_interrupt) options.keep_waiting = [] { return interrupt_signal() == 0; };
    if (patience == Patience::of_a_waiting_client) {
        options.patience_seconds = 1e9;  // whoever waits decides how long
        options.news = [](const std::string& what) { std::fprintf(stderr, "rcsplat: %s\n", printable(what).c_str()); };
    }
    if (!arguments.token_file.empty()) {
        options.token = read_part(arguments.token_file, 0, 4096);
        while (!options.token.empty() && (options.token.back() == '\n' || options.token.back() == '\r'))
            options.token.pop_back();
    }
    return Client(arguments.address, options);
}

}  // namespace rcs::service
