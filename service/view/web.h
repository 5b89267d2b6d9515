#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "view/door.h"
#include "view/look.h"

namespace rcs::service {

/// Files of service/view/page by name.
const std::map<std::string, std::string>& view_page_sources();

/// What a page's socket brings; all called from the server's own thread.
struct Visits {
    std::function<std::string()> greeting;    ///< a page is there, in place of any before it: what to tell it first
    std::function<void()> gone;               ///< it has gone, and no other is there
    std::function<void(const Wish&)> wished;  ///< it wants something
};

/// Serves the page, and its WebSocket, on loopback by a thread of its own. One page is served at a time: the newest
/// takes over, and the one before is told. Messages that cannot be read end the connection with the reason.
class ViewServer {
public:
    /// @param port  0: any that is free
    /// @throws rcs::Error io: the port is taken
    ViewServer(int port, Visits visits);
    ~ViewServer();
    ViewServer(const ViewServer&) = delete;
    ViewServer& operator=(const ViewServer&) = delete;

    /// Sees the page off: no visit is heard of from then on.
    void stop();

    const Door& door() const;
    /// To the page, if one is there; from any thread.
    void tell(std::string json);
    /// The same of a frame: bytes.
    void show(std::string message);

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace rcs::service
