// Clients that wait for a job, and what they bring home.

#include <csignal>
#include <filesystem>
#include <string>

#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "process/printable.h"
#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using service::Client;

class WaitingClient : public RenderService {
protected:
    v1::JobStatus newest(Client& client)
    {
        v1::Request list;
        list.mutable_list();
        const v1::ListReply reply = client.call(list).list();
        return reply.jobs_size() > 0 ? reply.jobs(0) : v1::JobStatus();
    }
    std::vector<std::string> slow_submit(const TestServer& server, const std::string& output)
    {
        return {"submit", "demo:cornell", "--size", "200x200",  "--rays",
                "1024",   "-o",           output,   "--server", server.socket()};
    }
};

TEST_F(WaitingClient, OutlivesItsServer)
{
    TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = start(logs, slow_submit(server, folder_ / "a.png"));
    for (const int signal : {SIGKILL, SIGTERM}) {
        {
            Client client(server.socket());
            wait_until([&] { return newest(client).state() == v1::JOB_STATE_RUNNING; });
        }
        server.restart_after(signal);
    }
    const Outcome outcome = finish(pid, logs);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("the server has gone"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("the server is back"), std::string::npos) << outcome.err;
    EXPECT_GT(fs::file_size(folder_ / "a.png"), 1000u);
    Client client(server.socket());
    EXPECT_EQ(newest(client).job(), 1u) << "the same job";
}

TEST_F(WaitingClient, SaysHowToComeBackWhenItIsInterrupted)
{
    TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = start(logs, slow_submit(server, folder_ / "a.png"));
    Client client(server.socket());
    wait_until([&] { return newest(client).state() == v1::JOB_STATE_RUNNING && bytes_of(logs / "out") == "job 1\n"; });
    ::kill(pid, SIGINT);
    const Outcome outcome = finish(pid, logs);
    EXPECT_EQ(outcome.code, 130);
    EXPECT_NE(outcome.err.find("job 1 goes on: rcsplat watch 1"), std::string::npos) << outcome.err;
    EXPECT_EQ(client.watch(1).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(WaitingClient, WritesFramesAsTheyFinishAndNamesTheHoles)
{
    TestServer server(folder_.path());
    const TemporaryFolder logs;
    auto words = slow_submit(server, folder_ / "f.####.png");
    words.insert(words.end(), {"--frames", "1-3"});
    const pid_t pid = start(logs, words);
    wait_until([&] { return fs::exists(folder_ / "f.0001.png"); });
    Client client(server.socket());
    EXPECT_EQ(newest(client).state(), v1::JOB_STATE_RUNNING) << "the others are still rendered";
    client.cancel(1);
    const Outcome outcome = finish(pid, logs);
    EXPECT_EQ(outcome.code, kFailure);
    EXPECT_NE(outcome.err.find("job 1, 2 of 3 frames have no pictures: frame 2 cancelled"), std::string::npos)
        << outcome.err;
    fs::create_directory(folder_ / "home");
    const Outcome fetched = rcsplat({"fetch", "1", "-o", folder_ / "home", "--server", server.socket()});
    EXPECT_EQ(fetched.code, kFailure) << "with holes";
    EXPECT_NE(fetched.err.find("frame 3 cancelled"), std::string::npos) << fetched.err;
    EXPECT_TRUE(bytes_of(folder_ / "home/f.0001.png") == bytes_of(folder_ / "f.0001.png")) << "under the same name";
    const Outcome again = rcsplat({"cancel", "1", "--server", server.socket()});
    EXPECT_NE(again.out.find("had ended before"), std::string::npos) << again.out;
}

TEST_F(WaitingClient, OneFailedFrameDoesNotKeepTheOthers)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    v1::Job job = small_job();
    for (int i = 0; i < 3; ++i) job.add_frames()->set_number(i);
    job.mutable_frames(1)->set_camera_name("nowhere");
    client.watch(client.submit(job).job());
    fs::create_directory(folder_ / "home");
    const Outcome fetched = rcsplat({"fetch", "1", "-o", folder_ / "home", "--server", server.socket()});
    EXPECT_EQ(fetched.code, kFailure);
    EXPECT_NE(fetched.err.find("1 of 3 frames have no pictures: frame 1 failed"), std::string::npos) << fetched.err;
    EXPECT_NE(fetched.err.find("nowhere"), std::string::npos) << fetched.err;
    EXPECT_TRUE(fs::exists(folder_ / "home/a.0000.png") && fs::exists(folder_ / "home/a.0002.png"));
}

TEST_F(WaitingClient, ASceneMayBeASymbolicLink)
{
    TestServer server(folder_.path());
    fs::create_symlink(scene_file("cornell"), folder_ / "link.glb");
    const Outcome outcome = rcsplat(
        {"submit", folder_ / "link.glb", "--size", "16x16", "-o", folder_ / "a.png", "--server", server.socket()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST_F(WaitingClient, NamesSteerNoTerminalAndNoLog)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    v1::Job job = small_job();
    job.mutable_scene()->set_label(
        "red \x1b[31m\xc2\x9b"
        "2J \xe2\x80\xae");
    job.add_frames()->set_camera_name("\x1b]0;title\x07");
    const auto number = client.submit(job).job();
    client.watch(number);
    const std::string text = std::to_string(number);
    for (const auto& words : {std::vector<std::string>{"list"}, {"list", text}, {"watch", text}, {"fetch", text}}) {
        auto all = words;
        all.insert(all.end(), {"--server", server.socket()});
        const Outcome outcome = rcsplat(all);
        for (std::string shown : {outcome.out, outcome.err}) {
            std::erase(shown, '\n');
            EXPECT_EQ(service::printable(shown), shown) << words[0];
        }
    }
    std::string log = server.log();
    std::erase(log, '\n');
    EXPECT_EQ(service::printable(log), log);
}

TEST_F(WaitingClient, SaysNothingToAStrangersSocket)
{
    if (::getuid() != 0) GTEST_SKIP() << "only root can be somebody else";
    const std::string path = folder_ / "socket";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    fs::permissions(folder_.path(), fs::perms(0777));
    int ready[2], heard[2];
    ASSERT_EQ(::pipe(ready) + ::pipe(heard), 0);
    const pid_t stranger = ::fork();
    if (stranger == 0) {
        if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
        const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
        if (::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(fd, 1) != 0) ::_exit(8);
        char byte = 'x';
        if (::write(ready[1], &byte, 1) != 1) ::_exit(7);
        const int client = ::accept(fd, nullptr, nullptr);
        ::_exit(::recv(client, &byte, 1, 0) == 0 ? 0 : 1);
    }
    char byte = 0;
    ASSERT_EQ(::read(ready[0], &byte, 1), 1);
    EXPECT_EQ(code_of([&] { Client client(path); }), v1::ERROR_CODE_FORBIDDEN);
    int status = 0;
    ::waitpid(stranger, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0) << "not a byte was sent";
}

}  // namespace
}  // namespace rcs::test
