#pragma once

#include <optional>
#include <string>

#include "server/config.h"
#include "server/log.h"
#include "server/sockets.h"
#include "wire/stream.h"

namespace rcs::service {

/// What TCP clients have to show, and what the server shows them.
struct Secrets {
    std::string token;
    std::optional<TlsContext> tls;
};

/// @throws rcs::Error, ServiceError: a file that is missing or that others can read
Secrets read_secrets(const ServerConfig& config);

/// Where clients arrive.
class Listeners {
public:
    /// @throws rcs::Error: an address in use
    Listeners(const ServerConfig& config, const ServerLog& log, bool tls);

    int fd(bool local) const { return local ? unix_.fd() : tcp_.get(); }  ///< -1: there is none

private:
    UnixListener unix_;
    Fd tcp_;
};

/// Where browsers do. @return none where the page is off
Fd listen_for_browsers(const ServerConfig& config, const ServerLog& log);

}  // namespace rcs::service
