#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/session.h"
#include "rcs/v1/job.pb.h"

namespace rcs::test {

/// Jobs of the drills: each number has pictures of its own, in some 0.05 s.
class DrillJobs {
public:
    /// @param folder  for the scene that some of them upload, and for pictures rendered here
    explicit DrillJobs(const std::string& folder);

    const std::string& scene_file() const { return scene_file_; }
    /// One in three uploads scene_file(), one in five has three frames; all have a picture a.png a frame.
    v1::Job job(std::uint64_t number) const;
    /// `rcsplat submit` of a job of one frame of a built-in scene, that writes `output`.
    static std::vector<std::string> submit_words(std::uint64_t number, const std::string& output);
    static bool can_be_words(std::uint64_t number) { return number % 3 != 0 && number % 5 != 0; }
    /// SHA-256 of the picture of each frame, rendered in this process. Always by the same thread.
    std::vector<std::string> expected(std::uint64_t number);

private:
    std::string render_frame(const v1::Job& job, const v1::Frame& frame);

    std::string folder_, scene_file_, shown_;
    Session session_;
};

}  // namespace rcs::test
