#pragma once

#include <string>

#include "cli/describe.h"

namespace rcs::service {

/// A manual page, man(7).
std::string manual_page(const CommandText& command);

/// All commands with all options, as a page of the documentation (docs/commands.md).
std::string commands_page(const CommandText& program);

}  // namespace rcs::service
