// Input that means harm: lengths of 4 GiB, random bytes, broken and nested messages, half frames, connections that say
// nothing, wrong versions; two messages a connection, every second one by a stranger over TCP. The server has to stay
// up, to let local users in at any time, to serve them about as fast as before, and to keep neither descriptors nor
// memory.
//
//     hostile [CONNECTIONS [SEED]]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <random>

#include <arpa/inet.h>
#include <netinet/in.h>
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

int connected(int family, const sockaddr* address, socklen_t size)
{
    const int fd = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    timeval patience{0, 200'000};
    ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (::connect(fd, address, size) == 0) return fd;
    ::close(fd);
    return -1;
}

int connect_raw(const std::string& socket)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket.copy(address.sun_path, sizeof address.sun_path - 1);
    return connected(AF_UNIX, reinterpret_cast<sockaddr*>(&address), sizeof address);
}

int connect_tcp(long port)
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return connected(AF_INET, reinterpret_cast<sockaddr*>(&address), sizeof address);
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

/// Any byte but the tag of PauseRequest: the server's own user, who sends half of this, may pause the queue, and then
/// no job is rendered.
char any_byte(std::mt19937& random)
{
    constexpr char kPause = 15 << 3 | 2;
    const char byte = static_cast<char>(random());
    return byte == kPause ? '\0' : byte;
}

std::string broken_request(std::mt19937& random)
{
    std::string request = service::frame(any_request(random));
    for (unsigned i = 0; i < 1 + random() % 4; ++i) request[random() % request.size()] = any_byte(random);
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
            for (auto& c : bytes += std::string(random() % 3000, ' ')) c = random() % 10 == 0 ? any_byte(random) : c;
            return bytes;
        case 2:
            return bytes + broken_request(random);
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

/// Processes that keep every core busy and say nothing.
class BusyMachine {
public:
    BusyMachine()
    {
        for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i) {
            pids_.push_back(::fork());
            if (pids_.back() != 0) continue;
            for (volatile unsigned spin = 0;;) spin = spin + 1;
        }
    }
    ~BusyMachine()
    {
        for (const pid_t pid : pids_) ::kill(pid, SIGKILL), ::waitpid(pid, nullptr, 0);
    }

private:
    std::vector<pid_t> pids_;
};

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
    static constexpr std::size_t kMostSilent = 200;

public:
    Attacker(const std::string& socket, long port, unsigned seed) : socket_(socket), port_(port), random_(seed) {}
    ~Attacker()
    {
        for (const int fd : silent_) ::close(fd);
    }

    void attack(int number)
    {
        const int fd = number % 2 == 0 ? connect_raw(socket_) : connect_tcp(port_);
        if (fd < 0) {
            ++unreachable_;
            return;
        }
        // Slow loris: they hold a place and say half a thing.
        if (number % 100 < 2) {
            send_in_pieces(fd, service::greeting().substr(0, 5));
            silent_.push_back(fd);
            if (silent_.size() > kMostSilent) ::close(silent_.front()), silent_.pop_front();
            return;
        }
        send_in_pieces(fd, evil_bytes(random_) + broken_request(random_));
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
    long port_;
    std::mt19937 random_;
    std::deque<int> silent_;
    int unreachable_ = 0;
};

bool renders(Client& client)
{
    return client.watch(client.submit(test::small_job()).job()).state() == v1::JOB_STATE_COMPLETED;
}

/// Clients that mean well, meanwhile.
struct HonestWork {
    std::vector<double> latencies;  // [s]
    int jobs = 0, jobs_completed = 0, newcomers = 0, locked_out = 0;

    void ask(Client& client)
    {
        latencies.push_back(latency(client));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    /// Somebody who was not here before.
    void come_in(const std::string& socket)
    {
        ++newcomers;
        try {
            Client newcomer(socket);
            latency(newcomer);
        } catch (const service::ServiceError& e) {
            ++locked_out;
            std::printf("locked out: %s\n", e.what());
        }
    }
    void go_on(Client& client, const std::string& socket, const std::atomic<bool>& done)
    {
        Client other(socket);
        for (int i = 0; !done; ++i) {
            ask(client);
            if (i % 50 == 0) come_in(socket);
            if (i % 500 != 0) continue;
            ++jobs;
            jobs_completed += renders(other);
        }
    }
};

/// They are in a process of their own, as strangers are: its processor time is not that of those who mean well.
class AttackingProcess {
public:
    static constexpr int kParts = 5;

    template <typename MakeAttacker>
    AttackingProcess(int connections, const MakeAttacker& make_attacker)
    {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) std::abort();
        pid_ = ::fork();
        if (pid_ != 0) {
            ::close(ends[1]);
            from_ = ends[0];
            return;
        }
        int unreachable = 0;
        {
            Attacker attacker = make_attacker();
            for (int i = 0; i < connections; ++i) {
                attacker.attack(i);
                unreachable = attacker.unreachable();
                const bool is_part = (i + 1) % (connections / kParts) == 0;
                if (is_part && ::write(ends[1], &unreachable, sizeof unreachable) < 0) break;
            }
        }
        ::_exit(0);
    }
    /// Waits for it. @return false: the process has died
    bool has_done_a_part() { return ::read(from_, &unreachable_, sizeof unreachable_) == sizeof unreachable_; }
    /// @return connections that were not taken
    int end()
    {
        ::waitpid(pid_, nullptr, 0);
        ::close(from_);
        return unreachable_;
    }

private:
    pid_t pid_ = 0;
    int from_ = -1, unreachable_ = 0;
};

/// What a server keeps.
struct Kept {
    explicit Kept(pid_t server)
        : descriptors(std::distance(std::filesystem::directory_iterator("/proc/" + std::to_string(server) + "/fd"), {}))
    {
        const std::string status = test::bytes_of("/proc/" + std::to_string(server) + "/status");
        megabytes = 1e-3 * std::atof(status.c_str() + status.find("VmRSS:") + 6);
    }
    long descriptors;
    double megabytes;
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
    const int connections = argc > 1 ? std::atoi(argv[1]) : 10'000;
    const test::TemporaryFolder folder;
    test::TestServer server(folder.path(), {"--message-seconds", "2", "--listen", "127.0.0.1:0"});
    Client honest(server.socket());
    renders(honest);
    HonestWork usual, busy, under_fire;
    for (int i = 0; i < 500; ++i) usual.ask(honest);
    {
        const BusyMachine spinning;
        for (int i = 0; i < 500; ++i) busy.ask(honest);
    }
    std::vector<Kept> kept{Kept(server.pid())};
    std::atomic<bool> done = false;
    AttackingProcess attack(connections, [&] {
        return Attacker(server.socket(), server.last_number("address=127.0.0.1 port="),
                        argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1);
    });
    std::thread honest_work([&] { under_fire.go_on(honest, server.socket(), done); });
    for (int part = 0; part < AttackingProcess::kParts && attack.has_done_a_part(); ++part)
        kept.emplace_back(server.pid());
    done = true;
    honest_work.join();
    const int unreachable = attack.end();
    const bool up = still_renders(honest);
    kept.emplace_back(server.pid());
    std::printf("%d hostile connections (%d not taken), half of them over TCP, %d messages, 1 in 50 kept open\n",
                connections, unreachable, 2 * connections);
    std::printf("meanwhile %d of %d jobs completed, %d of %d newcomers were locked out\n", under_fire.jobs_completed,
                under_fire.jobs, under_fire.locked_out, under_fire.newcomers);
    std::puts("an honest client's request, median and p95 in ms:");
    const auto tell = [](const char* when, const HonestWork& work) {
        std::printf("  %-42s %.3f %.3f\n", when, 1e3 * percentile(work.latencies, 0.5),
                    1e3 * percentile(work.latencies, 0.95));
    };
    tell("before", usual);
    tell("before, with every core busy elsewhere", busy);
    tell("meanwhile", under_fire);
    for (const Kept& now : kept) std::printf("  %ld descriptors, %.1f MB\n", now.descriptors, now.megabytes);
    constexpr double kMore = 16.0;  // [MB]: what the first fifth brings to stay
    const bool flat = kept.back().megabytes < kept[1].megabytes + kMore && kept.back().descriptors < 64;
    const bool good =
        up && under_fire.jobs == under_fire.jobs_completed && unreachable == 0 && under_fire.locked_out == 0 && flat;
    std::puts(good ? "all held" : "NOT all held");
    return good ? 0 : 1;
}
