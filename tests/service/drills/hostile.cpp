// Input that means harm: lengths of 4 GiB, random bytes, broken and nested messages, half frames, connections that say
// nothing, wrong versions. The server has to stay up and to serve others about as fast as before. hostile [MESSAGES
// [SEED]]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "service/drills/percentile.h"
#include "support/server.h"

namespace {

using namespace rcs;
using service::Client;
using test::percentile;
using Clock = std::chrono::steady_clock;

int connect_raw(const std::string& socket)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket.copy(address.sun_path, sizeof address.sun_path - 1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    timeval patience{0, 200'000};
    ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
        ::close(fd);
        return -1;
    }
    return fd;
}

v1::Request any_request(std::mt19937& random)
{
    v1::Request request;
    request.set_id(random());
    switch (random() % 8) {
        case 0:
            *request.mutable_submit()->mutable_job() = test::small_job(1 << 20);
            break;
        case 1: {
            v1::Job job = test::small_job();
            const char* const paths[] = {"/etc/passwd", "../../etc/shadow", "/proc/self/mem", "//", "/dev/zero", "\n"};
            job.mutable_scene()->set_path(paths[random() % 6]);
            *request.mutable_submit()->mutable_job() = job;
            break;
        }
        case 2: {
            v1::Job job = test::small_job();
            v1::SceneFile& file = *job.mutable_scene()->mutable_files()->add_files();
            file.set_path("../../../tmp/x");
            file.mutable_content()->set_sha256(std::string(32, 'x'));
            *request.mutable_submit()->mutable_job() = job;
            break;
        }
        case 3:
            request.mutable_fetch()->set_name("../../queue.db"), request.mutable_fetch()->set_job(1);
            break;
        case 4:
            request.mutable_watch()->set_job(random());
            break;
        case 5:
            request.mutable_blob_put()->mutable_blob()->set_sha256(std::string(random() % 40, '/'));
            request.mutable_blob_put()->mutable_blob()->set_size(~0ull);
            request.mutable_blob_put()->set_data("x");
            break;
        case 6:
            request.mutable_list()->set_limit(~0u);
            break;
        default:
            request.mutable_job()->set_job(random()), request.mutable_job()->set_first_frame(~0u);
    }
    return request;
}

std::string evil_bytes(std::mt19937& random)
{
    std::string bytes = service::greeting();
    v1::Request hello;
    hello.mutable_hello();
    if (random() % 4 != 0) bytes += service::frame(hello);
    switch (random() % 7) {
        case 0:
            return bytes + "\xff\xff\xff\xff\x0f" + std::string(100, 'x');
        case 1:
            for (auto& c : bytes += std::string(random() % 3000, ' '))
                c = random() % 10 == 0 ? static_cast<char>(random()) : c;
            return bytes;
        case 2: {
            std::string request = service::frame(any_request(random));
            for (unsigned i = 0; i < 1 + random() % 4; ++i)
                request[random() % request.size()] = static_cast<char>(random());
            return bytes + request;
        }
        case 3: {
            const std::string request = service::frame(any_request(random));
            return bytes + request.substr(0, random() % request.size());
        }
        case 4: {
            std::string nested;
            for (int i = 0; i < 60; ++i)
                nested = std::string(1, '\x2a').append(1, static_cast<char>(nested.size())).append(nested);
            return bytes + static_cast<char>(nested.size()) + nested;
        }
        case 5:
            bytes[4 + random() % 4] = static_cast<char>(random());
            return bytes;
        default:
            return bytes + service::frame(any_request(random));
    }
}

double latency(Client& client)
{
    v1::Request health;
    health.mutable_health();
    const auto begin = Clock::now();
    client.call(health);
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Clients that mean harm, one after the other.
class Attacker {
public:
    Attacker(const std::string& socket, unsigned seed) : socket_(socket), random_(seed) {}
    ~Attacker()
    {
        for (const int fd : silent_) ::close(fd);
    }

    void attack(int number)
    {
        const int fd = connect_raw(socket_);
        if (fd < 0) {
            ++unreachable_;
            return;
        }
        send_in_pieces(fd, evil_bytes(random_));
        // Slow loris: they hold a connection and say nothing, or half a thing.
        if (number % 100 == 0 && silent_.size() < 50) {
            silent_.push_back(fd);
            return;
        }
        if (random_() % 3 == 0) {
            ::shutdown(fd, SHUT_WR);
            char answer[4096];
            while (::recv(fd, answer, sizeof answer, 0) > 0) {
            }
        }
        ::close(fd);
    }
    int unreachable() const { return unreachable_; }

private:
    void send_in_pieces(int fd, const std::string& bytes)
    {
        std::size_t sent = 0;
        while (sent < bytes.size()) {
            const std::size_t piece = std::min<std::size_t>(1 + random_() % 500, bytes.size() - sent);
            if (::send(fd, bytes.data() + sent, piece, MSG_NOSIGNAL) < 0) return;
            sent += piece;
        }
    }

    std::string socket_;
    std::mt19937 random_;
    std::vector<int> silent_;
    int unreachable_ = 0;
};

bool renders(Client& client)
{
    return client.watch(client.submit(test::small_job()).job()).state() == v1::JOB_STATE_COMPLETED;
}

/// A client that means well, meanwhile.
struct HonestWork {
    std::vector<double> latencies;  // [s]
    int jobs = 0, jobs_completed = 0;

    void ask(Client& client)
    {
        latencies.push_back(latency(client));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    void go_on(Client& client, const std::string& socket, const std::atomic<bool>& done)
    {
        Client other(socket);
        for (int i = 0; !done; ++i) {
            ask(client);
            if (i % 500 != 0) continue;
            ++jobs;
            jobs_completed += renders(other);
        }
    }
};

bool still_renders(Client& client)
{
    try {
        return renders(client);
    } catch (const std::exception& e) {
        std::printf("%s\n", e.what());
        return false;
    }
}

}  // namespace

int main(int argc, char** argv)
{
    const int messages = argc > 1 ? std::atoi(argv[1]) : 10'000;
    const test::TemporaryFolder folder;
    test::TestServer server(folder.path(), {"--message-seconds", "2"});
    Client honest(server.socket());
    renders(honest);
    HonestWork usual, under_fire;
    for (int i = 0; i < 500; ++i) usual.ask(honest);
    std::atomic<bool> done = false;
    std::thread honest_work([&] { under_fire.go_on(honest, server.socket(), done); });
    int unreachable = 0;
    {
        Attacker attacker(server.socket(), argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1);
        for (int i = 0; i < messages; ++i) attacker.attack(i);
        done = true;
        honest_work.join();
        unreachable = attacker.unreachable();
    }
    const bool up = still_renders(honest);
    std::printf("%d hostile connections (%d not taken), 1 in 100 kept open; meanwhile %d of %d jobs completed\n",
                messages, unreachable, under_fire.jobs_completed, under_fire.jobs);
    std::printf(
        "an honest client's request: median %.2f ms before, %.2f ms meanwhile; p95 %.2f ms before, %.2f ms meanwhile\n",
        1e3 * percentile(usual.latencies, 0.5), 1e3 * percentile(under_fire.latencies, 0.5),
        1e3 * percentile(usual.latencies, 0.95), 1e3 * percentile(under_fire.latencies, 0.95));
    const bool good = up && under_fire.jobs == under_fire.jobs_completed && unreachable == 0;
    std::puts(good ? "all held" : "NOT all held");
    return good ? 0 : 1;
}
