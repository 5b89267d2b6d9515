#include "worker/elsewhere.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include <unistd.h>

#include "process/process.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

constexpr auto kBetweenReports = std::chrono::milliseconds(250);

std::string own_host()
{
    const char* const node = std::getenv("SLURMD_NODENAME");
    return node != nullptr ? node : "this machine";
}

}  // namespace

void check_is_shared(const std::string& state, const std::string& home)
{
    if (std::filesystem::is_directory(home)) return;
    throw ServiceError(v1::ERROR_CODE_IO, "a worker on " + own_host() + " does not see the server's state folder " +
                                              state + ", which all machines have to share");
}

int threads_by_slurm()
{
    const char* const given = std::getenv("SLURM_CPUS_ON_NODE");
    return given != nullptr ? std::max(0, std::atoi(given)) : 0;
}

void tell_of_this_process(ServerLink& link)
{
    internal::FromWorker started;
    started.set_started(own_host());
    link.send(started);
    std::thread([&link] {
        for (std::uint64_t told = 0;; std::this_thread::sleep_for(kBetweenReports)) {
            const std::uint64_t memory = resident_memory(::getpid());
            if (memory == told) continue;
            internal::FromWorker news;
            news.set_memory(told = memory);
            link.send(news);
        }
    }).detach();
}

}  // namespace rcs::service
