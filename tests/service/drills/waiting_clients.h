#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "service/drills/drill_jobs.h"

namespace rcs::test {

/// What a client got.
struct Served {
    std::uint64_t number = 0;           ///< of the drill's job
    std::uint64_t job = 0;              ///< as the server counts; 0: it was never taken
    std::vector<std::string> pictures;  ///< SHA-256 by frame; "": none
    std::string reason;                 ///< why there are not all; "": there are
    int code = 0;                       ///< v1::ErrorCode of that
    bool in_time = true;
};

/// Clients that each submit a job, wait for it whatever becomes of the server, and fetch its pictures; each by a thread
/// of its own, in part by `rcsplat submit`.
class WaitingClients {
public:
    WaitingClients(const std::string& socket, const std::string& folder, const DrillJobs& jobs)
        : socket_(socket), folder_(folder), jobs_(jobs)
    {
    }
    ~WaitingClients();  ///< waits for them

    /// @param dies  its `rcsplat submit` is killed while it waits, and another one comes for the same job
    void begin(std::uint64_t number, bool as_process, bool dies);
    int waiting() const { return waiting_; }
    std::vector<Served> take_served();

    /// Refusals by what they said, of all clients.
    std::map<std::string, int> refusals() const;

private:
    void run(std::uint64_t number, bool as_process, bool dies);
    void serve_by_library(Served& served);
    void fetch(Served& served);
    void serve_by_process(Served& served, bool dies);
    std::uint64_t submit(std::uint64_t number);
    void note(const std::string& refusal);

    std::string socket_, folder_;
    const DrillJobs& jobs_;
    std::atomic<int> waiting_ = 0;
    mutable std::mutex mutex_;
    std::vector<Served> served_;
    std::map<std::string, int> refusals_;
};

}  // namespace rcs::test
