#pragma once

#include <string>

namespace rcs::service {

/// "HOST:PORT", "[::1]:PORT". @throws rcs::Error bad_argument
struct HostPort {
    std::string host, port;
};
HostPort parse_host_port(const std::string& text);
/// An address of this machine's own, or "localhost"; a name that only looks like one is none.
bool is_loopback(const std::string& host);

/// Where a server listens and a client looks unless told: $XDG_RUNTIME_DIR/rcsplat/socket, else
/// /tmp/rcsplat-UID/socket.
std::string default_socket();

}  // namespace rcs::service
