#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "cli/job_of_arguments.h"
#include "cli/progress_bar.h"
#include "client/client.h"

namespace rcs::service {

/// Uploads what the server lacks, and submits.
v1::SubmitReply submit(Client& client, const RequestedJob& requested, ProgressBar& bar);

/// Shows how the job goes on until it has ended, in one bar over all its frames. Calls `news` with each state.
/// @throws ServiceError: why there is no more news of it; rcs::Error cancelled
v1::JobStatus follow(Client& client, std::uint64_t job, ProgressBar& bar,
                     const std::function<void(const v1::JobStatus&)>& news = {});

/// "running, 17 of 40 frames, error 2.1 %, about 3.2 min to go".
std::string progress_text(const v1::JobStatus& status);

/// Calls `use` with every frame of a job.
void for_each_frame(Client& client, std::uint64_t job, const std::function<void(const v1::FrameStatus&)>& use);

/// Calls `use` with frames of a job that have ended, by their places in it, some more than once.
/// @param first_open  where to begin: those before have ended, and been told; moves on
void for_each_ended(Client& client, std::uint64_t job, std::uint32_t& first_open,
                    const std::function<void(std::uint32_t index, const v1::FrameStatus&)>& use);

/// Of a job or frame, as a person and a script read it.
std::string state_text(v1::JobState state);
std::string state_text(v1::FrameState state);

/// What --json of a command about a job prints. @param what  came of it
void print_job_json(const std::string& command, std::uint64_t job, const nlohmann::ordered_json& what);

}  // namespace rcs::service
