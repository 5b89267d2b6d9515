#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include <poll.h>

#include "server/connection.h"
#include "server/listeners.h"

namespace rcs::service {

/// Where clients arrive and leave, in a thread of its own: whatever strangers say, and however many come and go, takes
/// no time from those who are in already. In goes who has said who he is, and has asked for something in order. Users
/// of this machine and clients of TCP have places of their own, and of those few are for who has not said yet who he
/// is: the one that has been silent for longest goes when another comes.
class Reception {
public:
    /// @throws rcs::Error, ServiceError: an address in use, a secret that is missing or that others can read
    Reception(const ServerConfig& config, const ServerLog& log, Counters& counters);
    ~Reception();  ///< who is still here is told that the server has stopped
    Reception(const Reception&) = delete;
    Reception& operator=(const Reception&) = delete;

    int fd() const { return arrival_.get(); }  ///< to be polled: readable when somebody may go in
    /// Those who may.
    std::list<Connection> take();
    /// Sends what these are still to be sent, and closes.
    void see_off(std::list<Connection> leaving);
    /// Limits and secrets, read anew. @throws as the constructor; nothing has changed then
    void adopt(const ServerConfig& config);

private:
    struct Rules;
    struct Bell {  ///< rings in another thread's poll()
        Bell();
        void ring() const;
        void silence() const;
        int get() const { return fd.get(); }
        Fd fd;
    };

    class Door {  ///< that lets in so many in a while
    public:
        std::int64_t count(std::int64_t now);  ///< who may come now
        void take();

    private:
        std::int64_t credit_ms_ = 0, since_ms_ = 0;
    };

    void run(const std::stop_token& stop);
    void turn();
    void wait();
    void take_orders();
    void hear_all();
    void hear(Connection& newcomer);
    void greet(Connection& newcomer, const v1::Request& request) const;
    std::size_t count(bool local) const;
    std::size_t silent(bool local) const;  ///< who have not said who they are
    std::size_t most_silent() const;
    bool has_room(bool local, std::int64_t now) const;
    void let_in_all(bool local);
    void let_in(Fd fd, bool local, std::int64_t now);
    void hand_over();
    void drop(std::int64_t now);

    const ServerLog& log_;
    Counters& counters_;
    std::shared_ptr<const Rules> rules_;  ///< of this thread
    Listeners listeners_;
    std::vector<pollfd> polled_;
    std::list<Connection> newcomers_, leaving_;
    std::size_t inside_[2] = {};  ///< handed over, from afar and local
    std::int64_t accept_after_ms_ = 0;
    Door door_[2];  ///< for those from afar and local ones

    Bell arrival_, order_;
    std::mutex mutex_;  ///< of the three below, which both threads know
    std::list<Connection> arrived_, to_see_off_;
    std::shared_ptr<const Rules> new_rules_;
    std::jthread thread_;  ///< last: the others are there while it runs
};

}  // namespace rcs::service
