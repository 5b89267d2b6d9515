#pragma once

#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace rcs::service {

/// The file that a program's name stands for, where this process finds programs; "" without one.
std::string find_program(const std::string& name);

/// How a program is started.
struct Start {
    std::vector<std::string> words;                            ///< its file, and what it is told
    std::optional<std::vector<std::string>> environment = {};  ///< NAME=VALUE; none: this process's
    std::string output = {};                                   ///< file for all that it says; "": as this process
    bool in_own_group = false;                                 ///< so that what it starts can be ended with it
};

/// Starts a program, which has nothing to read, no signal blocked and none that this process handles.
/// @return 0: it could not be started, by `error` (errno)
pid_t start_program(Start start, int& error);

}  // namespace rcs::service
