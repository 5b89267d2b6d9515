#pragma once

#include <string>

namespace rcs::service {

/// The mark of a frame that is being made. @param path  of its record
inline std::string running_path(const std::string& path) { return path + ".running"; }
/// What such a mark says: how often the frame was begun by a process that did not end it; 0 without one.
int starts_without_end(const std::string& running);

/// Says by such a file that a frame is being made, and how often that was begun; only processes that died leave it.
class RunningMark {
public:
    /// @throws rcs::Error io
    explicit RunningMark(std::string path);
    ~RunningMark();
    RunningMark(const RunningMark&) = delete;
    RunningMark& operator=(const RunningMark&) = delete;

private:
    std::string path_;
};

}  // namespace rcs::service
