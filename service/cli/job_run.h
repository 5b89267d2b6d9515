#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cli/job_of_arguments.h"
#include "cli/progress_bar.h"
#include "client/client.h"

namespace rcs::service {

/// Uploads what the server lacks, and submits.
v1::SubmitReply submit(Client& client, const RequestedJob& requested, ProgressBar& bar);

/// Shows how the job goes on until it has ended. Calls `news` with each state.
/// @throws ServiceError: why there is no more news of it; rcs::Error cancelled
v1::JobStatus follow(Client& client, std::uint64_t job, ProgressBar& bar,
                     const std::function<void(const v1::JobStatus&)>& news = {});

/// Calls `use` with every frame of a job.
void for_each_frame(Client& client, std::uint64_t job, const std::function<void(const v1::FrameStatus&)>& use);

/// Of a job or frame, as a person and a script read it.
std::string state_text(v1::JobState state);
std::string state_text(v1::FrameState state);

}  // namespace rcs::service
