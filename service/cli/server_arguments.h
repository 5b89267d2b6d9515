#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "client/client.h"

namespace rcs::service {

/// Which server, and how it is to know us.
struct ServerArguments {
    std::string address;
    std::string token_file;
    std::string ca, certificate, key;
};
void add_server_arguments(CLI::App& command, ServerArguments& arguments);

enum class Patience {
    of_one_question,        ///< a signal ends it, and so does the server's end
    of_a_waiting_client,    ///< a signal ends it; the server may go and come back
    none_and_no_interrupt,  ///< where the signal has come already
};
/// @throws ServiceError, rcs::Error
Client connect(const ServerArguments& arguments, Patience patience = Patience::of_one_question);

}  // namespace rcs::service
