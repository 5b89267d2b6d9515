#pragma once

#include <cstdint>
#include <list>
#include <vector>

#include <poll.h>

#include "server/connection.h"
#include "server/http.h"
#include "server/listeners.h"

namespace rcs::service {

/// Who is connected, and who may be. Users of this machine, clients of TCP and browsers each have places of their own,
/// and of those few are for who has not said anything yet: the one that has been silent for longest goes when another
/// comes.
class Guests {
public:
    Guests(const ServerConfig& config, const ServerLog& log, Counters& counters);

    /// Adds the listening sockets to what is polled, which is not empty: those of which another one may come in.
    void add_listeners_to(std::vector<pollfd>& polled, std::int64_t now);
    /// Lets in who waits. @param polled  since add_listeners_to()
    void let_in(const std::vector<pollfd>& polled);
    /// Takes leave of who has gone, and of who took too long.
    void drop(std::int64_t now);

    std::list<Connection>& connections() { return connections_; }
    std::list<HttpConnection>& browsers() { return browsers_; }
    Listeners& listeners() { return listeners_; }

private:
    std::size_t most_silent() const;
    bool has_room(bool local, std::int64_t now) const;
    bool has_room_for_browser(std::int64_t now) const;
    void let_in_clients(bool local);
    void let_in(Fd fd, bool local, std::int64_t now);

    const ServerConfig& config_;
    const ServerLog& log_;
    Counters& counters_;
    Listeners listeners_;
    std::list<Connection> connections_;
    std::list<HttpConnection> browsers_;
    std::int64_t accept_after_ms_ = 0;
};

}  // namespace rcs::service
