#pragma once

#include <string>

#include "worker/server_link.h"

/// Workers that Slurm starts, on whatever machine.
namespace rcs::service {

/// @throws ServiceError io: this machine does not see the server's folders
void check_is_shared(const std::string& state, const std::string& home);

/// Processors that Slurm gave; 0: it says nothing of them.
int threads_by_slurm();

/// To a server that cannot look: where this process is, and from now on how much memory it takes.
/// @param link  is to outlive this process's threads
void tell_of_this_process(ServerLink& link);

}  // namespace rcs::service
