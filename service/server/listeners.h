#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <poll.h>

#include "server/config.h"
#include "server/log.h"
#include "server/sockets.h"
#include "wire/stream.h"

namespace rcs::service {

/// Where clients and browsers arrive, and what TCP clients have to show.
class Listeners {
public:
    /// @throws rcs::Error, ServiceError: an address in use, a file that is missing or that others can read
    Listeners(const ServerConfig& config, const ServerLog& log);

    /// Token and certificates of TCP, anew.
    void read_secrets(const ServerConfig& config);

    /// Adds the listening sockets to what is polled, which is not empty.
    void add_to(std::vector<pollfd>& polled, bool unix_clients, bool tcp_clients, bool browsers);
    struct Waiting {
        bool unix_client = false, tcp_client = false, browser = false;
    };
    /// @param polled  since add_to()
    Waiting waiting(const std::vector<pollfd>& polled) const;

    int unix_fd() const { return unix_.fd(); }
    int tcp_fd() const { return tcp_.get(); }
    int http_fd() const { return http_.get(); }
    Stream stream_of(Fd tcp_client) const;
    const std::string& token() const { return token_; }

private:
    UnixListener unix_;
    Fd tcp_, http_;
    std::string token_;
    std::optional<TlsContext> tls_;
    std::size_t polled_unix_ = 0, polled_tcp_ = 0, polled_http_ = 0;  ///< 0: not there
};

}  // namespace rcs::service
