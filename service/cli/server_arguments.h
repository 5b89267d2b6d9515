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

/// @param interruptible  waiting ends when a signal comes @throws ServiceError, rcs::Error
Client connect(const ServerArguments& arguments, bool interruptible = true);

}  // namespace rcs::service
