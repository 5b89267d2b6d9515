#pragma once

#include <cstdint>
#include <list>
#include <vector>

#include <poll.h>

#include "server/http.h"
#include "server/reception.h"

namespace rcs::service {

/// Who is in: clients that have said who they are, and browsers.
class Guests {
public:
    Guests(const ServerConfig& config, const ServerLog& log, Counters& counters);

    /// Adds to what is polled where clients and browsers come in.
    void add_doors_to(std::vector<pollfd>& polled, std::int64_t now);
    /// Lets in who waits. @param polled  since add_doors_to()
    void let_in(const std::vector<pollfd>& polled);
    /// Takes leave of who has gone, and of who took too long.
    void drop(std::int64_t now);

    std::list<Connection>& connections() { return connections_; }
    std::list<HttpConnection>& browsers() { return browsers_; }
    Reception& reception() { return reception_; }

private:
    bool has_room_for_browser(std::int64_t now) const;
    void let_in_browsers();

    const ServerConfig& config_;
    const ServerLog& log_;
    Fd http_;
    std::list<Connection> connections_;
    std::list<HttpConnection> browsers_;
    std::size_t first_door_ = 0;  ///< in what is polled
    Reception reception_;
};

}  // namespace rcs::service
