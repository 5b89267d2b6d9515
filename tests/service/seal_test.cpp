// The walls around workers: one that was taken over gets nowhere, and all others do their work.

#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "seal/seal.h"
#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using service::Client;

class SealedWorker : public RenderService {
protected:
    void SetUp() override
    {
        if (!service::available_seal().is_whole()) GTEST_SKIP() << "this kernel lacks Landlock or seccomp";
        fs::create_directory(folder_ / "outside");
        write_bytes(folder_ / "outside" + "/sentinel", "secret");
    }
};

/// What a worker that was taken over tried, with errno; 0: it succeeded.
std::map<std::string, int> attempts(const TestServer& server)
{
    std::map<std::string, int> tried;
    for (const auto& entry : fs::recursive_directory_iterator(server.state() + "/results")) {
        if (entry.path().filename() != "tried") continue;
        std::istringstream report(bytes_of(entry.path().string()));
        for (std::string name; report >> name;) report >> tried[name];
    }
    return tried;
}

TEST_F(SealedWorker, ThatWasTakenOverGetsNowhere)
{
    const service::Fd listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    socklen_t size = sizeof address;
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::bind(listener.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
    ASSERT_EQ(::listen(listener.get(), 1), 0);
    ::getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size);
    TestServer server(folder_.path(), {},
                      {"env", "LD_PRELOAD=" RCS_BIN_DIR "/libtraitor.so", "TRAITOR_OUTSIDE=" + folder_ / "outside",
                       "TRAITOR_STATE=" + folder_ / "state", "TRAITOR_SOCKET=" + folder_ / "run" + "/socket",
                       "TRAITOR_PORT=" + std::to_string(ntohs(address.sin_port))});
    Client client(server.socket());
    EXPECT_EQ(client.watch(client.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
    std::map<std::string, int> tried = attempts(server);
    EXPECT_EQ(tried.extract("own-folder").mapped(), 0) << "it may write there";
    EXPECT_EQ(tried.size(), 20u);
    for (const auto& [name, error] : tried) {
        EXPECT_TRUE(error == EACCES || error == EPERM || error == EXDEV) << name << ": " << std::strerror(error);
    }
    EXPECT_EQ(bytes_of(folder_ / "outside" + "/sentinel"), "secret");
}

TEST_F(SealedWorker, IsSaidSoByHealthLogAndCheck)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    v1::Request request;
    request.mutable_health();
    wait_until([&] { return client.call(request).health().serving(); });
    const std::string walls = service::describe(service::available_seal());
    EXPECT_EQ(client.call(request).health().seal(), walls);
    EXPECT_NE(server.log().find("kept_from=\"" + walls + "\""), std::string::npos) << server.log();
    EXPECT_NE(rcsplat({"serve", "--check", "--socket", server.socket(), "--state", folder_ / "other"}).out.find(walls),
              std::string::npos);
    const std::string status = bytes_of("/proc/" + std::to_string(server.worker()) + "/status");
    for (const char* line : {"NoNewPrivs:\t1", "Seccomp:\t2", "CapEff:\t0000000000000000"})
        EXPECT_NE(status.find(line), std::string::npos) << line;
}

TEST_F(SealedWorker, ReadsRootsThatAReloadBrought)
{
    fs::create_directory(folder_ / "roots");
    const std::string scene = scene_file("cornell");
    fs::rename(scene, folder_ / "roots" + "/a.glb");
    write_bytes(folder_ / "config", "");
    TestServer server(folder_.path(), {"--config", folder_ / "config"});
    Client client(server.socket());
    v1::Job job = small_job();
    job.mutable_scene()->set_path(folder_ / "roots" + "/a.glb");
    EXPECT_EQ(code_of([&] { client.submit(job); }), v1::ERROR_CODE_FORBIDDEN);
    write_bytes(folder_ / "config", "root = " + folder_ / "roots" + "\n");
    ::kill(server.pid(), SIGHUP);
    wait_until([&] { return server.log().find("event=reloaded") != std::string::npos; });
    EXPECT_EQ(client.watch(client.submit(job).job()).state(), v1::JOB_STATE_COMPLETED) << server.log();
}

TEST(Seal, SaysWhatIsMissing)
{
    EXPECT_EQ(service::describe({3, true}), "files (Landlock 3), network, programs and processes");
    EXPECT_NE(service::describe({0, true}).find("not files"), std::string::npos);
    EXPECT_NE(service::describe({3, false}).find("not network"), std::string::npos);
    EXPECT_FALSE((service::Seal{0, true}.is_whole()));
}

}  // namespace
}  // namespace rcs::test
