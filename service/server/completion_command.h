#pragma once

#include <cstdint>
#include <list>
#include <string>
#include <vector>

#include <sys/types.h>

#include "rcs/v1/job.pb.h"
#include "server/config.h"
#include "server/log.h"

namespace rcs::service {

/// The operator's command for jobs that have ended, a process for each, few at a time; no shell is asked. It hears of
/// the job by RCSPLAT_JOB, _STATE, _OWNER, _SCENE, _FRAMES, _COMPLETED, _FAILED and _REASON in its environment. It is
/// killed, with all that it started, when it takes too long; what its exit code says goes to the log alone.
class CompletionCommand {
public:
    CompletionCommand(const ServerConfig& config, const ServerLog& log);
    ~CompletionCommand();  ///< kills those that run: their jobs are announced again by the next server
    CompletionCommand(const CompletionCommand&) = delete;
    CompletionCommand& operator=(const CompletionCommand&) = delete;

    bool is_idle() const;
    bool has_room() const;
    bool runs_for(std::uint64_t job) const;
    void start(const v1::JobStatus& job, std::int64_t now_ms);
    /// Jobs whose command has ended, or could not be started.
    std::vector<std::uint64_t> take(std::int64_t now_ms);

private:
    struct Running {
        std::uint64_t job = 0;
        pid_t pid = 0;  ///< 0: it could not be started
        std::int64_t until_ms = 0;
        bool killed = false;
    };
    const ServerConfig& config_;
    const ServerLog& log_;
    std::list<Running> running_;
};

}  // namespace rcs::service
