#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "wire/files.h"

namespace rcs::service {

/// Sends files to browsers in a thread of its own: no disk holds up the server's loop.
class FileSender {
public:
    FileSender();
    ~FileSender();  ///< what waits is dropped
    FileSender(const FileSender&) = delete;
    FileSender& operator=(const FileSender&) = delete;

    /// @param head  of the answer, without its length and without its end   @return false: too many wait
    bool send(Fd browser, const std::string& path, const std::string& head);

private:
    struct Order {
        Fd browser;
        std::string path, head;
    };
    void run();

    std::mutex mutex_;
    std::condition_variable arrived_;
    std::deque<Order> orders_;
    bool stopping_ = false;
    std::thread thread_;
};

}  // namespace rcs::service
