// Many tiny jobs from many clients at a time: every one has to end once, with the same picture, and the server has to
// stay as small as it was. Prints what it saw; exit code 0 only if all held. many_jobs [JOBS [CLIENTS]]
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>

#include <nlohmann/json.hpp>

#include "service/drills/percentile.h"
#include "support/server.h"

namespace {

using namespace rcs;
using service::Client;
using test::percentile;
using Clock = std::chrono::steady_clock;

double value(Client& client, const char* name)
{
    v1::Request request;
    request.mutable_stats();
    return client.call(request).stats().values().at(name);
}

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

class Drill {
public:
    Drill(const std::string& folder, int jobs) : jobs_(jobs), server_(folder), observer_(server_.socket()) {}

    void run(int clients)
    {
        const auto begin = Clock::now();
        std::vector<std::thread> threads;
        for (int i = 0; i < clients; ++i)
            threads.emplace_back([&] {
                Client client(server_.socket());
                while (next_++ < jobs_) run_job(client);
            });
        for (std::thread& thread : threads) thread.join();
        wall_ = seconds_since(begin);
    }

    /// @return whether all held
    bool judge(int clients)
    {
        const double completed = value(observer_, "rcsplat_frames_completed_total");
        const double memory = value(observer_, "rcsplat_server_memory_bytes");
        const double growth = memory_at_200_ > 0.0 ? memory / memory_at_200_ - 1.0 : 0.0;
        std::printf("%zu jobs from %d clients in %.1f s: %d wrong, %.0f frames completed, %zu different pictures\n",
                    numbers_.size(), clients, wall_, wrong_, completed, pictures_.size());
        std::printf(
            "overhead of a job beyond queue and rendering: median %.1f ms, p95 %.1f ms; acknowledged after: median "
            "%.1f ms, p95 %.1f ms\n",
            1e3 * percentile(overhead_, 0.5), 1e3 * percentile(overhead_, 0.95), 1e3 * percentile(acknowledged_, 0.5),
            1e3 * percentile(acknowledged_, 0.95));
        std::printf("the worker did not render for %.1f ms a job\n", 1e3 * (wall_ - rendering_) / jobs_);
        std::printf("server's memory: %.1f MB after 200 jobs, %.1f MB after all (%+.1f %%)\n", 1e-6 * memory_at_200_,
                    1e-6 * memory, 100.0 * growth);
        return wrong_ == 0 && numbers_.size() == static_cast<std::size_t>(jobs_) && completed == jobs_ &&
               pictures_.size() == 1 && growth <= 0.1;
    }

private:
    void run_job(Client& client)
    {
        const auto start = Clock::now();
        const std::uint64_t job = client.submit(test::small_job()).job();
        const double acknowledged = seconds_since(start);
        const v1::JobStatus end = client.watch(job);
        const double all = seconds_since(start);
        const v1::JobReply details = client.details(job, 0, 1);
        const auto stats = nlohmann::json::parse(details.frames(0).stats_json(), nullptr, false);
        const double render = stats.is_object() ? stats.value("seconds", 0.0) : 0.0;
        const double queued = 1e-3 * static_cast<double>(end.started_ms() - end.submitted_ms());
        const std::scoped_lock lock(mutex_);
        acknowledged_.push_back(acknowledged);
        overhead_.push_back(all - queued - render);
        rendering_ += render;
        wrong_ +=
            end.state() != v1::JOB_STATE_COMPLETED || !numbers_.insert(job).second || details.frames(0).attempts() != 1;
        for (const v1::OutputFile& file : details.frames(0).files()) pictures_.insert(file.sha256());
        if (numbers_.size() == 200) memory_at_200_ = value(observer_, "rcsplat_server_memory_bytes");
    }

    int jobs_;
    test::TestServer server_;
    Client observer_;
    std::atomic<int> next_ = 0;
    std::mutex mutex_;                             // of all below
    std::vector<double> overhead_, acknowledged_;  // [s]
    std::set<std::uint64_t> numbers_;
    std::set<std::string> pictures_;
    double rendering_ = 0.0, wall_ = 0.0;  // [s]
    double memory_at_200_ = 0.0;           // after 200 jobs [bytes]
    int wrong_ = 0;
};

}  // namespace

int main(int argc, char** argv)
{
    const int jobs = argc > 1 ? std::atoi(argv[1]) : 1000, clients = argc > 2 ? std::atoi(argv[2]) : 16;
    const test::TemporaryFolder folder;
    Drill drill(folder.path(), jobs);
    drill.run(clients);
    const bool good = drill.judge(clients);
    std::puts(good ? "all held" : "NOT all held");
    return good ? 0 : 1;
}
