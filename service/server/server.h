#pragma once

#include <functional>

#include "server/config.h"

namespace rcs::service {

/// Serves until SIGTERM or SIGINT: running frames get a grace to end, what waits stays in the queue. SIGHUP reads the
/// configuration anew. One thread: connections, the socket's clients, workers and signals take turns.
/// @param reload  the configuration as it is now @throws rcs::Error, ServiceError if it cannot start
void serve(const ServerConfig& config, const std::function<ServerConfig()>& reload);

}  // namespace rcs::service
