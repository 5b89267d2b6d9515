#pragma once

#include <CLI/CLI.hpp>

#include "server/config.h"

namespace rcs::service {

/// Of `rcsplat serve`.
void add_server_options(CLI::App& command, ServerConfig& config);

}  // namespace rcs::service
