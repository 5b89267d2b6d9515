#pragma once

#include <string>

#include "server/sockets.h"

/// What a process does that runs for long beneath a service manager.
namespace rcs::service {

/// SIGTERM, SIGINT, SIGHUP and SIGCHLD as a file to read from.
Fd catch_signals();

/// As many files as this user may have open: each connection is one.
void raise_file_limit();

/// Tells systemd, if it started us (sd_notify(3)).
void notify(const std::string& state);

}  // namespace rcs::service
