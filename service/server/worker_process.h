#pragma once

#include <string>
#include <vector>

#include <sys/types.h>

#include "server/config.h"
#include "wire/files.h"

/// Processes of workers: how they begin and end, on this machine or, by Slurm's srun, on another.
namespace rcs::service {

struct WorkerProcess {
    pid_t pid = 0;  ///< of the worker, or of the srun that passes on what the server and it say
    Fd socket;      ///< the server's end
};

/// @param home  folder that it alone may write to   @throws ServiceError io
WorkerProcess start_worker(const ServerConfig& config, const std::string& home);

/// Ends one without a wait. Slurm ends its own when srun is told to.
void kill_worker(pid_t pid, WorkerEngine engine);
/// Ends them; they are gone afterwards.
void end_workers(const std::vector<pid_t>& pids, WorkerEngine engine);

/// What waitpid() said, for people. srun passes a signal on as the shell does.
std::string how_it_ended(int status);

}  // namespace rcs::service
