#pragma once

#include <string>

#include "cli/describe.h"

namespace rcs::service {

/// A script by which a shell completes the program's command line. @param shell  "bash", "zsh" or "fish"
std::string completion_script(const CommandText& program, const std::string& shell);

}  // namespace rcs::service
