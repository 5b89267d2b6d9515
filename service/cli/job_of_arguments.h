#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/render_arguments.h"
#include "cli/shutter.h"
#include "client/client.h"

namespace rcs::service {

/// The job that renders what a command line would, without its frames, and what it needs.
struct RequestedJob {
    v1::Job job;
    std::vector<Client::LocalFile> uploads;
    std::vector<std::string>
        paths;  ///< to write the outputs to, in the job's order; may hold #### for a frame's number
};

/// @param on_server  the scene is a path there @throws rcs::Error
RequestedJob request_job(const RenderArguments& arguments, const Shutter& shutter, bool on_server);

/// A frame with the camera of the command line, but for one that moves along a path, which the job has.
/// @param time  [s]; none: the rest pose
v1::Frame request_frame(const RenderArguments& arguments, int number, std::optional<double> time);

}  // namespace rcs::service
