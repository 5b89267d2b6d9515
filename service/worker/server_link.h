#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>

#include "rcs/internal/worker.pb.h"

namespace rcs::service {

/// A worker's end of the socket to its server, or of what passes it on. A thread of its own listens, so that a running
/// frame can be cancelled; when the server is gone the process ends at once.
class ServerLink {
public:
    ServerLink(int in, int out);  ///< what they are open for; may be the same
    ServerLink(const ServerLink&) = delete;
    ServerLink& operator=(const ServerLink&) = delete;

    internal::Task next_task();                      ///< waits for it
    bool cancelled() const { return cancelled_; }    ///< the task that was taken last
    void send(const internal::FromWorker& message);  ///< of any thread

private:
    void listen();

    int in_, out_;
    std::mutex mutex_, sending_;
    std::condition_variable arrived_;
    std::deque<internal::Task> tasks_;
    std::atomic<bool> cancelled_ = false;
};

}  // namespace rcs::service
