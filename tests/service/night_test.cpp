// What happens to a render service at night.

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using service::Client;

class Night : public RenderService {
protected:
    /// A server that refuses to start. @return what it says; "" if it starts all the same
    std::string refusal(const TestServer& server)
    {
        const TemporaryFolder logs;
        const pid_t pid = start(logs, {"serve", "--socket", server.socket(), "--state", server.state()});
        wait_until(
            [&] { return fs::exists(server.socket()) || bytes_of(logs / "err").find("error: ") != std::string::npos; });
        ::kill(pid, SIGKILL);
        const std::string said = finish(pid, logs).err;
        return said.starts_with("rcsplat: error: ") ? said : "";
    }
};

TEST_F(Night, ALostDatabaseStopsTheStartAndRecoveringKeepsPicturesAndNumbers)
{
    TestServer server(folder_.path());
    std::uint64_t last = 0;
    {
        Client client(server.socket());
        for (int i = 0; i < 3; ++i) last = client.submit(small_job()).job();
        client.watch(last);
    }
    server.end(SIGTERM);
    fs::remove(server.state() + "/queue.db");
    EXPECT_NE(refusal(server).find("queue.db is lost; started with --recover"), std::string::npos);
    EXPECT_EQ(std::distance(fs::directory_iterator(server.state() + "/results"), {}), 3);
    server.add_options({"--recover"});
    server.start();
    EXPECT_EQ(std::distance(fs::directory_iterator(server.state() + "/aside"), {}), 3 + 1) << "and the old database";
    Client client(server.socket());
    const auto next = client.submit(small_job()).job();
    EXPECT_GT(next, last);
    EXPECT_EQ(client.watch(next).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(Night, ADamagedDatabaseIsNamedAndItsPicturesAreKept)
{
    TestServer server(folder_.path());
    const auto job = Client(server.socket()).submit(small_job()).job();
    Client(server.socket()).watch(job);
    server.end(SIGTERM);
    const std::string picture = fs::directory_iterator(server.state() + "/results")->path() / "a.png";
    const std::string before = bytes_of(picture);
    const std::string path = server.state() + "/queue.db";
    std::string bytes = bytes_of(path);
    bytes.replace(4096, 4096, 4096, '\0');  // the jobs
    write_bytes(path, bytes);
    EXPECT_NE(refusal(server).find("is damaged"), std::string::npos);
    server.add_options({"--recover"});
    server.start();
    EXPECT_NE(server.log().find("event=recovered"), std::string::npos) << server.log();
    Client client(server.socket());
    EXPECT_GT(client.submit(small_job()).job(), job);
    const std::string folder = server.state() + "/aside/" + fs::path(picture).parent_path().filename().string();
    EXPECT_EQ(bytes_of(folder + "/a.png"), before);
}

TEST_F(Night, AJumpingClockFailsExpiresAndDisconnectsNothing)
{
    const std::string shift = folder_ / "shift";
    write_bytes(shift, "0");
    ::setenv("LD_PRELOAD", RCS_BIN_DIR "/libshifted_clock.so", 1);
    ::setenv("SHIFTED_CLOCK", shift.c_str(), 1);
    TestServer server(folder_.path());
    Client client(server.socket());
    const auto done = client.submit(small_job()).job();
    client.watch(done);
    const auto running = client.submit(long_job()).job();
    wait_until_rendering(client, running);
    constexpr long kHour = 3600, k1970 = -1'700'000'000, k2100 = 2'300'000'000;
    for (const long seconds : {kHour, -kHour, k2100, k1970, 2 * kHour}) {
        write_bytes(shift, std::to_string(seconds));
        EXPECT_EQ(client.details(running).status().state(), v1::JOB_STATE_RUNNING) << seconds;
        const auto between = client.submit(small_job()).job();
        client.cancel(between);
        wait_until([&] { return client.details(between).status().state() == v1::JOB_STATE_CANCELLED; });
    }
    for (const long seconds : {k2100, k1970}) {
        write_bytes(shift, std::to_string(seconds));
        server.restart_after(SIGKILL);  // looks at once for what is too old
        Client again(server.socket());
        wait_until_rendering(again, running);
        again.fetch(done, 0, "a.png", folder_ / "a.png");
    }
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("SHIFTED_CLOCK");
    EXPECT_EQ(server.log().find("timed_out"), std::string::npos) << server.log();
    EXPECT_EQ(server.log().find("event=expired"), std::string::npos) << server.log();
    EXPECT_EQ(server.log().find("took longer"), std::string::npos) << server.log();
    EXPECT_NE(server.log().find("time=2099-"), std::string::npos) << "the clock was set";
}

}  // namespace
}  // namespace rcs::test
