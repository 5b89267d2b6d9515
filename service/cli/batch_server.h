#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/batch_frame.h"
#include "cli/job_of_arguments.h"
#include "client/client.h"

namespace rcs::service {

/// Where the frame's job is noted while a server makes it. @param path  of its record
inline std::string job_path(const std::string& path) { return path + ".job"; }

/// Why a frame has no pictures, and what was said while it was tried; empty: it has.
struct Failure {
    std::string why, log;
};

/// Frames of a batch that a render server makes, by jobs of some hundred. A frame that a job of an earlier run makes
/// still is waited for, not asked for again.
class ServerFrames {
public:
    /// Told of each frame as it ends, and again when more is known of it.
    using Taker = std::function<void(const FrameRecord& frame, const Failure& failure)>;

    ServerFrames(const BatchArguments& arguments, FrameMaker& maker, ProgressBar& bar, Taker taker);

    /// To be made with the others. @throws ServiceError: nobody answers; rcs::Error
    void ask(FrameRecord wanted);
    /// Returns when all that was asked for has ended. @throws rcs::Error cancelled, once its jobs are
    void take_all();

private:
    struct Job {
        std::uint64_t number = 0;
        std::map<int, FrameRecord> frames;  ///< that have not ended
        std::uint32_t first_open = 0;       ///< as for_each_ended() takes it
    };

    std::vector<Job> jobs_of_before();
    std::optional<Job> submit_some();
    RequestedJob request() const;
    void follow_to_end(Job& job);
    void take(Job& job, std::uint32_t index, const v1::FrameStatus& frame);
    void fetch(const Job& job, std::uint32_t index, const v1::FrameStatus& frame, FrameRecord& wanted);
    void tell_change(FrameRecord& now) const;
    void end(FrameRecord& frame, const Failure& failure, bool is_lost = true) const;
    std::string log_of(const Job& job, int frame);
    void cancel(const std::vector<Job>& jobs) const;
    std::string mark_of(const FrameRecord& frame, const std::string& key) const;
    std::string path_of(int number) const { return record_path(maker_.paths_of(number).front()); }

    const BatchArguments& arguments_;
    FrameMaker& maker_;
    ProgressBar& bar_;
    const Taker taker_;
    const std::vector<int> numbers_;            // of the whole batch
    std::optional<Client> following_, asking_;  // one waits for news, one asks meanwhile
    std::map<int, FrameRecord> asked_;
};

}  // namespace rcs::service
