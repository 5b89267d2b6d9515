#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "queue/job_queue.h"

namespace rcs::service {

/// What was said while a frame is tried, a line for each thing with its time; bounded, what comes beyond is dropped.
class FrameLog {
public:
    void add(std::string_view what);
    const std::string& text() const { return text_; }

private:
    std::string text_;
};

/// Logs of frames whose tries have ended: STATE/logs/JOB/INDEX, all tries one after the other. They are for people:
/// where the disk takes none, there is none.
class FrameLogs {
public:
    explicit FrameLogs(const std::string& state);

    void append(FrameKey key, const std::string& text) const;
    std::string read(FrameKey key) const;  ///< at most kMostOfAFrame, the last of it
    void remove(std::uint64_t job) const;

private:
    static constexpr std::size_t kMostOfAFrame = 256 << 10;  ///< [bytes]
    std::string path(FrameKey key) const;

    std::string folder_;
};

}  // namespace rcs::service
