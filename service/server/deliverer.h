#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "queue/job_queue.h"

namespace rcs::service {

/// A frame's files, and where they are to go.
struct DeliveryTask {
    FrameKey key;
    std::string from;                                        ///< folder
    std::string to;                                          ///< folder, beneath the root and relative to it
    std::vector<std::pair<std::string, std::string>> files;  ///< names there, and here
};

struct DeliveryEnd {
    FrameKey key;
    std::string error;  ///< "": its files are there
};

/// Copies pictures to a folder beneath a root, one frame after the other, in a thread of its own: the disk there may be
/// slow, full or gone. Each file is written under a hidden name, synced and renamed, so that under its own it is whole.
/// No part of the way may be a symbolic link.
class Deliverer {
public:
    explicit Deliverer(std::string root);

    void give(DeliveryTask task);
    std::vector<DeliveryEnd> take();  ///< that came to be since the last call

private:
    void run(const std::stop_token& stop);

    std::string root_;
    std::mutex mutex_;  ///< of the two below
    std::deque<DeliveryTask> tasks_;
    std::vector<DeliveryEnd> ends_;
    std::condition_variable_any wake_;
    std::jthread thread_;  ///< last: the others are there while it runs
};

/// A job's folder relative to the root. @param folder  absolute beneath the root, or relative to it
/// @throws ServiceError forbidden: it leads elsewhere
std::string folder_beneath(const std::string& root, const std::string& folder);

}  // namespace rcs::service
