// Many tiny jobs from many clients at a time: every one has to end once, with the same picture, and the server has to
// stay as small as it was. Prints what it saw; exit code 0 only if all held. many_jobs [JOBS [CLIENTS]]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>

#include <nlohmann/json.hpp>

#include "support/server.h"

namespace {

using namespace rcs;
using service::Client;
using Clock = std::chrono::steady_clock;

double value(Client& client, const char* name)
{
    v1::Request request;
    request.mutable_stats();
    return client.call(request).stats().values().at(name);
}

double percentile(std::vector<double> values, double part)
{
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, static_cast<std::size_t>(part * static_cast<double>(values.size())))];
}

}  // namespace

int main(int argc, char** argv)
{
    const int jobs = argc > 1 ? std::atoi(argv[1]) : 1000, clients = argc > 2 ? std::atoi(argv[2]) : 16;
    const test::TemporaryFolder folder;
    test::TestServer server(folder.path());
    Client observer(server.socket());

    std::mutex mutex;
    std::vector<double> overhead, acknowledged;
    std::set<std::uint64_t> numbers;
    std::set<std::string> pictures;
    double rendering = 0.0, memory_at_200 = 0.0;
    int wrong = 0;
    std::atomic<int> next = 0;
    const auto begin = Clock::now();
    const auto work = [&] {
        Client client(server.socket());
        while (next++ < jobs) {
            const auto start = Clock::now();
            const std::uint64_t job = client.submit(test::small_job()).job();
            const double ack = std::chrono::duration<double>(Clock::now() - start).count();
            const v1::JobStatus end = client.watch(job);
            const double all = std::chrono::duration<double>(Clock::now() - start).count();
            const v1::JobReply details = client.details(job, 0, 1);
            const auto stats = nlohmann::json::parse(details.frames(0).stats_json(), nullptr, false);
            const double render = stats.is_object() ? stats.value("seconds", 0.0) : 0.0;
            const double queued = 1e-3 * static_cast<double>(end.started_ms() - end.submitted_ms());
            const std::scoped_lock lock(mutex);
            acknowledged.push_back(ack);
            overhead.push_back(all - queued - render);
            rendering += render;
            wrong += end.state() != v1::JOB_STATE_COMPLETED || !numbers.insert(job).second ||
                     details.frames(0).attempts() != 1;
            for (const v1::OutputFile& file : details.frames(0).files()) pictures.insert(file.sha256());
            if (numbers.size() == 200) memory_at_200 = value(observer, "rcsplat_server_memory_bytes");
        }
    };
    std::vector<std::thread> threads;
    for (int i = 0; i < clients; ++i) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();
    const double wall = std::chrono::duration<double>(Clock::now() - begin).count();

    const double completed = value(observer, "rcsplat_frames_completed_total");
    const double memory = value(observer, "rcsplat_server_memory_bytes");
    const double p95 = percentile(overhead, 0.95);
    const double growth = memory_at_200 > 0.0 ? memory / memory_at_200 - 1.0 : 0.0;
    std::printf("%zu jobs from %d clients in %.1f s: %d wrong, %.0f frames completed, %zu different pictures\n",
                numbers.size(), clients, wall, wrong, completed, pictures.size());
    std::printf(
        "overhead of a job beyond queue and rendering: median %.1f ms, p95 %.1f ms; acknowledged after: median %.1f "
        "ms, p95 %.1f ms\n",
        1e3 * percentile(overhead, 0.5), 1e3 * p95, 1e3 * percentile(acknowledged, 0.5),
        1e3 * percentile(acknowledged, 0.95));
    std::printf("the worker did not render for %.1f ms a job\n", 1e3 * (wall - rendering) / jobs);
    std::printf("server's memory: %.1f MB after 200 jobs, %.1f MB after all (%+.1f %%)\n", 1e-6 * memory_at_200,
                1e-6 * memory, 100.0 * growth);
    const bool good = wrong == 0 && numbers.size() == static_cast<std::size_t>(jobs) && completed == jobs &&
                      pictures.size() == 1 && growth <= 0.1;
    std::puts(good ? "all held" : "NOT all held");
    return good ? 0 : 1;
}
