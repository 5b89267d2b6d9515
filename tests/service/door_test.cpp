// Who comes in, what is let through, and what a server needs to be told.

#include <cstdlib>
#include <deque>
#include <filesystem>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/inotify.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "process/exit_code.h"
#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"
#include "wire/address.h"
#include "wire/framing.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using service::Client;
using service::Fd;

class Door : public RenderService {
protected:
    /// Somebody who connects and says nothing.
    static Fd connected(long port)
    {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        Fd fd(::socket(AF_INET, SOCK_STREAM, 0));
        EXPECT_EQ(::connect(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        return fd;
    }
    static Fd connected(const std::string& socket)
    {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        socket.copy(address.sun_path, sizeof address.sun_path - 1);
        Fd fd(::socket(AF_UNIX, SOCK_STREAM, 0));
        EXPECT_EQ(::connect(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        return fd;
    }
    static std::string ask(const Fd& fd, const std::string& host)
    {
        const std::string request = "GET /metrics HTTP/1.1\r\nHost: " + host + "\r\n\r\n";
        EXPECT_EQ(::send(fd.get(), request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
        std::string answer;
        char part[4096];
        for (ssize_t count = 0; (count = ::recv(fd.get(), part, sizeof part, 0)) > 0;)
            answer.append(part, static_cast<std::size_t>(count));
        return answer;
    }
};

TEST_F(Door, LoopbackIsAnAddressNotANameThatLooksLikeOne)
{
    for (const char* host : {"127.0.0.1", "127.8.9.10", "::1", "localhost"})
        EXPECT_TRUE(service::is_loopback(host)) << host;
    for (const char* host :
         {"127.evil.example", "127.0.0.1.evil.example", "127.", "128.0.0.1", "::2", "localhost.evil", ""})
        EXPECT_FALSE(service::is_loopback(host)) << host;
    for (const char* option : {"--listen", "--http"})
        EXPECT_EQ(rcsplat({"serve", option, "127.evil.example:7000", "--check"}).code, kBadUsage) << option;
}

TEST_F(Door, ThePageAnswersWhileFortyAreSilentAndToItsOwnNamesAlone)
{
    TestServer server(folder_.path(), {"--http", "127.0.0.1:0"});
    const long port = server.last_number("http=127.0.0.1 port=");
    EXPECT_EQ(ask(connected(port), "127.evil.example").substr(0, 12), "HTTP/1.1 403");
    EXPECT_EQ(ask(connected(port), "localhost\r\nHost: evil.example").substr(0, 12), "HTTP/1.1 403");
    std::vector<Fd> silent;
    for (int i = 0; i < 40; ++i) silent.push_back(connected(port));
    const auto begin = Clock::now();
    EXPECT_EQ(ask(connected(port), "localhost:1234").substr(0, 12), "HTTP/1.1 200");
    EXPECT_LT(seconds_since(begin), 6.0) << "silent ones have 10 s";
}

TEST_F(Door, StrangersTakeNoPlaceOfUsers)
{
    TestServer server(folder_.path(), {"--listen", "127.0.0.1:0", "--max-connections", "20"});
    const long port = server.last_number("address=127.0.0.1 port=");
    std::vector<Fd> silent;
    for (int i = 0; i < 60; ++i) silent.push_back(connected(port));
    Client client(server.socket());
    EXPECT_EQ(client.watch(client.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
    service::ClientOptions options;
    options.token = bytes_of(server.state() + "/token").substr(0, 64);
    wait_until([&] {
        try {
            Client("127.0.0.1:" + std::to_string(port), options);
            return true;
        } catch (const service::ServiceError&) {
            return false;
        }
    });
}

/// All that somebody wants, said at once by a client that then only listens: each answer comes, in order.
TEST_F(Door, HelloAndFortyRequestsMayComeInOnePacket)
{
    TestServer server(folder_.path());
    v1::Request hello, health;
    hello.mutable_hello();
    std::string bytes = service::greeting() + service::frame(hello);
    constexpr std::uint64_t kRequests = 40;
    for (std::uint64_t id = 1; id <= kRequests; ++id) {
        health.set_id(id);
        health.mutable_health();
        bytes += service::frame(health);
    }
    const Fd fd = connected(server.socket());
    ASSERT_EQ(::send(fd.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
    service::FrameReader reader;
    const auto next = [&] {
        for (;;) {
            if (const auto message = reader.next()) {
                v1::Response response;
                service::parse(*message, response);
                return response;
            }
            char part[4096];
            const ssize_t count = ::recv(fd.get(), part, sizeof part, 0);
            if (count <= 0) return v1::Response();
            reader.append({part, static_cast<std::size_t>(count)});
        }
    };
    std::string greeting(service::kGreetingSize, '\0');
    ASSERT_EQ(::recv(fd.get(), greeting.data(), greeting.size(), MSG_WAITALL), static_cast<ssize_t>(greeting.size()));
    EXPECT_TRUE(next().has_hello());
    for (std::uint64_t id = 1; id <= kRequests; ++id) {
        const v1::Response response = next();
        ASSERT_EQ(response.id(), id);
        EXPECT_TRUE(response.has_health());
    }
}

TEST_F(Door, WhoHasSaidHelloMaySayNothingMoreForAsLongAsHeLikes)
{
    TestServer server(folder_.path(), {"--max-connections", "20", "--message-seconds", "0.3"});
    Client patient(server.socket());
    std::vector<Fd> silent;
    for (int i = 0; i < 30; ++i) silent.push_back(connected(server.socket()));  // more than may be
    Client busy(server.socket());
    EXPECT_EQ(busy.watch(busy.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
    std::this_thread::sleep_for(std::chrono::milliseconds(1200));  // places of silent ones may be given away by now
    EXPECT_EQ(patient.watch(patient.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(Door, ACrowdThatComesAtOnceIsLetInToTheLast)
{
    TestServer server(folder_.path());
    constexpr std::size_t kCrowd = 200;
    std::deque<Client> crowd;
    while (crowd.size() < kCrowd) crowd.emplace_back(server.socket());
    v1::Request health;
    health.mutable_health();
    for (Client& client : crowd) EXPECT_TRUE(client.call(health).has_health());
}

TEST_F(Door, ThatTheServerStopsIsToldToWhoHasNotSaidAWord)
{
    TestServer server(folder_.path());
    const Fd silent = connected(server.socket());
    char greeting[service::kGreetingSize];
    ASSERT_EQ(::recv(silent.get(), greeting, sizeof greeting, MSG_WAITALL), static_cast<ssize_t>(sizeof greeting));
    EXPECT_EQ(server.end(SIGTERM), 0);
    std::string farewell(4096, '\0');
    const ssize_t count = ::recv(silent.get(), farewell.data(), farewell.size(), 0);
    ASSERT_GT(count, 0);
    EXPECT_NE(farewell.find("the server has stopped"), std::string::npos);
}

TEST_F(Door, ATokenFileThatIsNotThereOrTooShortIsNamed)
{
    const auto serve = [&](const std::string& token_file) {
        return rcsplat({"serve", "--socket", folder_ / "run/socket", "--state", folder_ / "state", "--listen",
                        "127.0.0.1:0", "--token-file", token_file});
    };
    const Outcome missing = serve(folder_ / "nowhere");
    EXPECT_EQ(missing.code, service::kNoInput);
    EXPECT_NE(missing.err.find("cannot read the token file " + (folder_ / "nowhere")), std::string::npos)
        << missing.err;
    write_bytes(folder_ / "short", "abc");
    fs::permissions(folder_ / "short", fs::perms::owner_read);
    EXPECT_EQ(serve(folder_ / "short").code, service::kBadData);
}

TEST_F(Door, AServerRefusesToGuessWhereItsQueueIs)
{
    const std::string home = std::getenv("HOME") != nullptr ? std::getenv("HOME") : "";
    ::unsetenv("HOME");
    ::unsetenv("XDG_STATE_HOME");
    const Outcome outcome = rcsplat({"serve", "--check"});
    const Outcome told = rcsplat({"serve", "--check", "--state", folder_ / "state"});
    if (!home.empty()) ::setenv("HOME", home.c_str(), 1);
    EXPECT_EQ(outcome.code, kBadUsage);
    EXPECT_NE(outcome.err.find("--state is missing"), std::string::npos) << outcome.err;
    EXPECT_EQ(told.code, 0) << told.err;
}

TEST_F(Door, SlurmIsAskedForAlone)
{
    const std::string path = std::getenv("PATH");
    ::setenv("PATH", folder_.path().c_str(), 1);
    const Outcome outcome = rcsplat({"serve", "--check", "--engine", "slurm"});
    ::setenv("PATH", path.c_str(), 1);
    EXPECT_EQ(outcome.code, service::kNoInput);
    EXPECT_NE(outcome.err.find("there is no srun in $PATH"), std::string::npos) << outcome.err;
    EXPECT_EQ(rcsplat({"serve", "--check", "--engine", "lsf"}).code, kBadUsage);
    EXPECT_EQ(rcsplat({"serve", "--check", "--srun-options", "--exclusive"}).code, kBadUsage);
}

TEST_F(Door, AReloadSaysWhatItDidNotTakeOver)
{
    const std::string file = folder_ / "config";
    write_bytes(file, "max-jobs = 10\n");
    TestServer server(folder_.path(), {"--config", file});
    write_bytes(file, "max-jobs = 20\nworkers = 3\nhttp = 127.0.0.1:0\n");
    ::kill(server.pid(), SIGHUP);
    wait_until([&] { return server.log().find("event=reloaded") != std::string::npos; });
    EXPECT_NE(server.log().find("only_at_the_next_start=--http,--workers"), std::string::npos) << server.log();
}

TEST_F(Door, CamerasThatNoRayReachesAreRefused)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    v1::Job job = small_job();
    v1::Camera& camera = *job.add_frames()->mutable_camera_given();
    for (int i = 0; i < 16; ++i) camera.add_world_from_view(i % 5 == 0 ? 1.0 : 0.0);
    camera.set_world_from_view(12, 1e19);
    EXPECT_EQ(code_of([&] { client.submit(job); }), v1::ERROR_CODE_BAD_ARGUMENT);
    camera.set_world_from_view(12, 1.0);
    camera.set_projection(v1::Camera::PROJECTION_ORTHOGRAPHIC);
    camera.set_ymag(1e30);
    EXPECT_EQ(code_of([&] { client.submit(job); }), v1::ERROR_CODE_BAD_ARGUMENT);
}

TEST_F(Door, AColourConfigurationReachesNoFiles)
{
    const std::string secret = folder_ / "secret.cube", config = folder_ / "config.ocio";
    write_bytes(secret, "LUT_1D_SIZE 2\n0 0 0\n1 1 1\n");
    TestServer server(folder_.path());
    const Fd watch(::inotify_init1(IN_NONBLOCK));
    ASSERT_GE(::inotify_add_watch(watch.get(), secret.c_str(), IN_OPEN | IN_ACCESS), 0);
    for (const std::string& names :
         {"search_path: .\nroles: {scene_linear: lin, default: lin}\nfile: {src: " + secret + "}\n",
          "search_path: " + folder_.path() +
              "\nroles: {scene_linear: lin, default: lin}\nfile: {src: secret.cube}\n"}) {
        const std::size_t file = names.find("file: ");
        write_bytes(config, "ocio_profile_version: 1\n" + names.substr(0, file) +
                                "displays:\n  screen:\n    - !<View> {name: plain, colorspace: out}\ncolorspaces:\n"
                                "  - !<ColorSpace> {name: lin}\n"
                                "  - !<ColorSpace> {name: out, from_reference: !<FileTransform> " +
                                names.substr(file + 6, names.size() - file - 7) + "}\n");
        const Outcome outcome = rcsplat({"submit", "demo:cornell", "--size", "16x16", "--ocio", config, "-o",
                                         folder_ / "a.png", "--server", server.socket()});
        EXPECT_EQ(outcome.code, kFailure);
        EXPECT_NE(outcome.err.find("names the file"), std::string::npos) << outcome.err;
        char event[sizeof(inotify_event) + 256];
        EXPECT_LT(::read(watch.get(), event, sizeof event), 0) << "the file was opened";
    }
    // Where it is rendered, its user may read it.
    const Outcome local =
        rcsplat({"render", "demo:cornell", "--size", "16x16", "--ocio", config, "-o", folder_ / "a.png", "-q"});
    EXPECT_EQ(local.code, 0) << local.err;
}

}  // namespace
}  // namespace rcs::test
