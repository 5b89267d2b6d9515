// A queue that is as full as it may be: asking it, adding to it and starting its server have to take as long as with an
// empty one. Prints what it saw; exit code 0 only if all held. full_queue [FRAMES]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "service/drills/percentile.h"
#include "support/server.h"

namespace {

using namespace rcs;
using service::Client;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

v1::Job job_of(int frames)
{
    v1::Job job = test::small_job();
    for (int i = 0; i < frames; ++i) job.add_frames()->set_number(i);
    return job;
}

/// The 95th percentile of what it takes [s].
double p95(const std::function<void()>& ask)
{
    std::vector<double> seconds;
    for (int i = 0; i < 200; ++i) {
        const auto begin = Clock::now();
        ask();
        seconds.push_back(seconds_since(begin));
    }
    return test::percentile(seconds, 0.95);
}

/// @return the slowest of submit, health and list
double measure(Client& client, const char* when)
{
    v1::Request health, list;
    health.mutable_health();
    list.mutable_list();
    const double submitted = p95([&] { client.submit(job_of(1)); });
    const double told = p95([&] { client.call(health); }), listed = p95([&] { client.call(list); });
    std::printf("%s: p95 of submit %.2f ms, health %.2f ms, list %.2f ms\n", when, 1e3 * submitted, 1e3 * told,
                1e3 * listed);
    return std::max({submitted, told, listed});
}

bool hold(const std::string& folder, int frames)
{
    constexpr int kOfAJob = 10'000;
    test::TestServer server(folder, {"--workers", "1", "--max-frames", "10000000"});
    double full = 0.0;
    {
        Client client(server.socket());
        v1::Request pause;
        pause.mutable_pause();
        client.call(pause);
        measure(client, "empty");
        const auto begin = Clock::now();
        for (int done = 0; done < frames; done += kOfAJob) client.submit(job_of(std::min(frames - done, kOfAJob)));
        std::printf("%d frames submitted in %.2f s\n", frames, seconds_since(begin));
        full = measure(client, "full");
    }
    server.end(SIGKILL);
    const auto begin = Clock::now();
    server.start();
    const double restart = seconds_since(begin);
    Client client(server.socket());
    v1::Request stats;
    stats.mutable_stats();
    const auto reply = client.call(stats).stats();
    const double memory = reply.values().at("rcsplat_server_memory_bytes");
    const double waiting = reply.values().at("rcsplat_frames_waiting");
    std::printf("restarted in %.2f s, %.0f frames wait, memory %.0f MB\n", restart, waiting, 1e-6 * memory);
    const bool is_long = frames >= 100'000;  // shortly, by the tests, no times are judged
    return (!is_long || (full < 5e-3 && restart < 3.0)) && memory < 300e6 && waiting >= frames;
}

}  // namespace

int main(int argc, char** argv)
{
    const int frames = argc > 1 ? std::atoi(argv[1]) : 100'000;
    const test::TemporaryFolder folder;
    const bool good = hold(folder.path(), frames);
    std::puts(good ? "all held" : "NOT all held");
    return good ? 0 : 1;
}
