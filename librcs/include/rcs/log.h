#pragma once

#include <functional>
#include <string_view>

namespace rcs {

/// What a line of the log is.
enum class LogLevel { debug, info, warning };

/// Receives one line at a time, without newline. The library never prints by itself; an empty
/// function discards. Called from the thread that called the library.
using LogFunction = std::function<void(LogLevel, std::string_view)>;

/// Receives the name of the running stage and its fraction done in [0, 1]. Returning false asks
/// the library to stop: it throws Error(cancelled) at the next opportunity.
using ProgressFunction = std::function<bool(std::string_view stage, float fraction)>;

}  // namespace rcs
