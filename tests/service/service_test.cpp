// The render service as its users see it: a real server, real workers, real clients.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rcs/error.h"
#include "rcs/scene.h"
#include "stability/export_glb.h"
#include "support/rcsplat.h"
#include "support/server.h"

namespace rcs {
namespace {

using service::Client;
using service::ServiceError;
using test::bytes_of;
using test::long_job;
using test::rcsplat;
using test::small_job;
using test::TemporaryFolder;
using test::TestServer;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

template <typename Use>
v1::ErrorCode code_of(const Use& use)
{
    try {
        use();
    } catch (const ServiceError& e) {
        return e.code();
    }
    return v1::ERROR_CODE_UNSPECIFIED;
}

void wait_until(const std::function<bool()>& holds)
{
    for (int i = 0; i < 3000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_TRUE(holds());
}

/// Waits until a job's frame has begun to render.
void wait_until_rendering(Client& client, std::uint64_t job)
{
    wait_until([&] {
        const v1::JobStatus status = client.details(job).status();
        return status.running_size() > 0 && status.running(0).fraction() > 0.1f;
    });
}

class RenderService : public ::testing::Test {
protected:
    /// A built-in scene as a file, without its textures and sky. @return its path
    std::string scene_file(const std::string& name)
    {
        const std::string path = folder_ / (name + ".glb");
        stability::export_glb(load_scene("demo:" + name), path);
        return path;
    }

    TemporaryFolder folder_;
};

TEST_F(RenderService, RendersTheSamePicturesAsTheCommandLineBitForBit)
{
    TestServer server(folder_.path());
    const std::string scene = scene_file("cornell");
    const std::vector<std::string> options = {"--size",         "48x40",          "--exposure", "1", "--layers",
                                              "indirect,depth", "--pixel-format", "float,16",   "-q"};
    const auto with = [&](std::vector<std::string> words, const std::string& name) {
        words.insert(words.end(), options.begin(), options.end());
        for (const char* ending : {".png", ".exr", ".jpg"})
            words.insert(words.end(), {"-o", (folder_ / name) + ending});
        return words;
    };
    const auto local = rcsplat(with({"render", scene}, "local"));
    ASSERT_EQ(local.code, 0) << local.err;
    auto remote = rcsplat(with({"render", scene, "--server", server.socket()}, "remote"));
    ASSERT_EQ(remote.code, 0) << remote.err;
    remote = rcsplat(with({"submit", scene, "--server", server.socket()}, "submitted"));
    ASSERT_EQ(remote.code, 0) << remote.err;
    for (const char* ending : {".png", ".exr", ".jpg"}) {
        const std::string expected = bytes_of((folder_ / "local") + ending);
        EXPECT_GT(expected.size(), 500u);
        EXPECT_TRUE(bytes_of((folder_ / "remote") + ending) == expected) << ending;
        EXPECT_TRUE(bytes_of((folder_ / "submitted") + ending) == expected) << ending;
    }
}

TEST_F(RenderService, SkiesAndShiftedLensesArriveToo)
{
    TestServer server(folder_.path());
    std::set<std::string> pictures;
    const std::vector<std::string> plain{"render", "demo:spheres", "--size", "32x32", "-q"};
    for (const std::vector<std::string>& more : {std::vector<std::string>{},
                                                 {"--environment", "none"},
                                                 {"--environment", "0.5,1,2"},
                                                 {"--lens-shift", "0.25,-0.5"}}) {
        std::vector<std::string> arguments = plain;
        arguments.insert(arguments.end(), more.begin(), more.end());
        arguments.insert(arguments.end(), {"-o", folder_ / "a.exr"});
        const auto local = rcsplat(arguments);
        arguments.back() = folder_ / "b.exr";
        arguments.insert(arguments.end(), {"--server", server.socket()});
        const auto remote = rcsplat(arguments);
        ASSERT_EQ(local.code + remote.code, 0) << local.err << remote.err;
        EXPECT_TRUE(bytes_of(folder_ / "a.exr") == bytes_of(folder_ / "b.exr")) << (more.empty() ? "plain" : more[1]);
        pictures.insert(bytes_of(folder_ / "a.exr"));
    }
    EXPECT_EQ(pictures.size(), 4u) << "they differ";
}

TEST_F(RenderService, FramesOfAnAnimationAreFilesOfTheirOwn)
{
    const std::string scene = RCS_SCENES_DIR "/cornell-animated.glb";
    if (!std::filesystem::exists(scene)) GTEST_SKIP() << "needs " << scene;
    TestServer server(folder_.path());
    const auto outcome = rcsplat({"submit", scene, "--frames", "1-5x2", "--fps", "2", "--size", "24x24", "-o",
                                  folder_ / "f.####.png", "--server", server.socket()});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::set<std::string> pictures;
    for (const char* name : {"f.0001.png", "f.0003.png", "f.0005.png"}) pictures.insert(bytes_of(folder_ / name));
    EXPECT_EQ(pictures.size(), 3u) << "the animation moves";
    EXPECT_FALSE(pictures.contains(""));
}

TEST_F(RenderService, AMissingCameraFailsTheJobWithItsReason)
{
    TestServer server(folder_.path());
    const auto outcome = rcsplat(
        {"render", "demo:cornell", "--camera", "nowhere", "-o", folder_ / "a.png", "--server", server.socket(), "-q"});
    EXPECT_EQ(outcome.code, test::kFailure);
    EXPECT_NE(outcome.err.find("nowhere"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.png"));
}

TEST_F(RenderService, CancelStopsARunningFrameSoon)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    const auto job = client.submit(long_job()).job();
    wait_until_rendering(client, job);
    const auto begin = Clock::now();
    client.cancel(job);
    EXPECT_EQ(client.watch(job).state(), v1::JOB_STATE_CANCELLED);
    EXPECT_LT(seconds_since(begin), 6.0);
    EXPECT_EQ(client.watch(client.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(RenderService, AnInterruptCancelsARenderOnTheServer)
{
    TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = test::start(logs, {"render", "demo:atrium", "--size", "2000x2000", "--aa", "64", "-o",
                                         folder_ / "a.png", "--server", server.socket()});
    Client client(server.socket());
    v1::Request list;
    list.mutable_list();
    wait_until([&] { return client.call(list).list().jobs_size() == 1; });
    ::kill(pid, SIGINT);
    EXPECT_EQ(test::finish(pid, logs).code, 130);
    wait_until([&] { return client.call(list).list().jobs(0).state() == v1::JOB_STATE_CANCELLED; });
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.png"));
}

TEST_F(RenderService, AJobThatKillsItsWorkerTwiceFailsAndTheQueueGoesOn)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    const auto job = client.submit(long_job()).job();
    for (int i = 0; i < 2; ++i) {
        wait_until_rendering(client, job);
        ::kill(server.worker(), SIGKILL);
        wait_until([&] { return client.details(job).status().running_size() == 0; });
    }
    const v1::JobStatus end = client.watch(job);
    EXPECT_EQ(end.state(), v1::JOB_STATE_FAILED);
    EXPECT_EQ(end.error().code(), v1::ERROR_CODE_WORKER_DIED);
    EXPECT_NE(end.error().message().find("signal 9"), std::string::npos) << end.error().message();
    EXPECT_EQ(client.watch(client.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(RenderService, AcknowledgedJobsSurviveTheServersDeath)
{
    TestServer server(folder_.path());
    std::vector<std::uint64_t> jobs;
    {
        Client client(server.socket());
        for (int i = 0; i < 5; ++i) jobs.push_back(client.submit(small_job()).job());
    }
    server.restart_after(SIGKILL);
    Client client(server.socket());
    std::set<std::string> pictures;
    for (const auto job : jobs) {
        EXPECT_EQ(client.watch(job).state(), v1::JOB_STATE_COMPLETED);
        pictures.insert(client.details(job).frames(0).files(0).sha256());
    }
    EXPECT_EQ(pictures.size(), 1u);
}

TEST_F(RenderService, StopsInOrderAndGoesOnLater)
{
    TestServer server(folder_.path(), {"--stop-grace", "0.2"});
    std::uint64_t job = 0;
    {
        Client client(server.socket());
        job = client.submit(long_job()).job();
        wait_until_rendering(client, job);
    }
    const auto begin = Clock::now();
    EXPECT_EQ(server.end(SIGTERM), 0);
    EXPECT_LT(seconds_since(begin), 5.0);
    EXPECT_FALSE(std::filesystem::exists(server.socket()));
    server.start();
    Client client(server.socket());
    wait_until_rendering(client, job);
    EXPECT_EQ(client.details(job).frames(0).attempts(), 1) << "what was given back does not count";
    client.cancel(job);
}

TEST_F(RenderService, LimitsOfTimeAndMemoryEndAFrameWithTheReason)
{
    TestServer server(folder_.path(), {"--memory-limit", "900"});
    Client client(server.socket());
    v1::Job job = long_job();
    job.set_time_limit_seconds(1.0);
    v1::JobStatus end = client.watch(client.submit(job).job());
    EXPECT_EQ(end.state(), v1::JOB_STATE_FAILED);
    EXPECT_EQ(end.error().code(), v1::ERROR_CODE_TIME_LIMIT) << end.error().message();
    job = small_job(8000);
    end = client.watch(client.submit(job).job());
    EXPECT_EQ(end.error().code(), v1::ERROR_CODE_MEMORY_LIMIT) << end.error().message();
    EXPECT_EQ(client.watch(client.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(RenderService, AWarmWorkerStartsTheNextFrameOfASceneAtOnce)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    v1::Job job = small_job();
    v1::SceneFile& file = *job.mutable_scene()->mutable_files()->add_files();
    const auto local = service::local_file(scene_file("atrium"));
    file.set_path("atrium.glb");
    *file.mutable_content() = local.blob;
    client.upload({local});
    client.watch(client.submit(job).job());
    double best = 1e9;
    for (int i = 0; i < 3; ++i) {
        const auto number = client.submit(job).job();
        const v1::JobStatus end = client.watch(number);
        const auto stats = nlohmann::json::parse(client.details(number, 0, 1).frames(0).stats_json());
        EXPECT_FALSE(stats["stage_seconds"].contains("load")) << "the scene was kept";
        best = std::min(best, 1e-3 * static_cast<double>(end.started_ms() - end.submitted_ms()));
    }
    EXPECT_LT(best, 0.1);
}

TEST_F(RenderService, UploadsAreResumedAndNotRepeated)
{
    TestServer server(folder_.path());
    const std::string path = folder_ / "blob";
    test::write_bytes(path, std::string(1'500'000, 'b'));
    const auto file = service::local_file(path);
    v1::Request put;
    *put.mutable_blob_put()->mutable_blob() = file.blob;
    put.mutable_blob_put()->set_data(std::string(400'000, 'b'));
    EXPECT_EQ(Client(server.socket()).call(put).blob_put().held(), 400'000u);
    server.restart_after(SIGKILL);
    Client client(server.socket());
    float first = -1.0f;
    client.upload({file}, [&](float fraction) { first = first < 0.0f ? fraction : first; });
    EXPECT_GT(first, 0.5f) << "went on from where it was";
    int chunks = 0;
    client.upload({file}, [&](float) { ++chunks; });
    EXPECT_EQ(chunks, 0);
}

TEST_F(RenderService, ScenesByPathStayBeneathTheRoots)
{
    namespace fs = std::filesystem;
    const std::string root = folder_ / "root";
    fs::create_directory(root);
    fs::copy(scene_file("cornell"), root + "/in.glb");
    fs::copy(root + "/in.glb", folder_ / "out.glb");
    fs::create_symlink(folder_ / "out.glb", root + "/link.glb");
    fs::create_directory_symlink(folder_.path(), root + "/folder");
    TestServer server(folder_.path(), {"--root", root});
    Client client(server.socket());
    const auto submit = [&](const std::string& path) {
        v1::Job job = small_job();
        job.mutable_scene()->set_path(path);
        return client.submit(job).job();
    };
    for (const std::string& path :
         {root + "/link.glb", root + "/folder/out.glb", root + "/../out.glb", folder_ / "out.glb",
          std::string("/etc/passwd"), std::string("in.glb"), root, root + "/in.glb/../in.glb"}) {
        EXPECT_EQ(code_of([&] { submit(path); }), v1::ERROR_CODE_FORBIDDEN) << path;
    }
    EXPECT_EQ(code_of([&] { submit(root + "/none.glb"); }), v1::ERROR_CODE_NOT_FOUND);
    EXPECT_EQ(client.watch(submit(root + "/in.glb")).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(RenderService, JobsThatCannotBeAreRefusedAtOnce)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    const auto code = [&](const auto& change) {
        v1::Job job = small_job();
        change(job);
        return code_of([&] { client.submit(job); });
    };
    EXPECT_EQ(code([](auto& j) { j.mutable_options()->set_width(0); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) { j.mutable_options()->set_width(16384), j.mutable_options()->set_height(16384); }),
              v1::ERROR_CODE_LIMIT);
    EXPECT_EQ(code([](auto& j) { j.mutable_scene()->set_builtin("demo:nothing"); }), v1::ERROR_CODE_NOT_FOUND);
    EXPECT_EQ(code([](auto& j) { j.clear_scene(); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) { j.clear_outputs(); }), v1::ERROR_CODE_BAD_ARGUMENT);
    for (const char* name : {"../a.png", "a/b.png", ".a.png", "a.tif", "", "a.png\n"}) {
        EXPECT_EQ(code([&](auto& j) { j.mutable_outputs(0)->set_name(name); }), v1::ERROR_CODE_BAD_ARGUMENT) << name;
    }
    EXPECT_EQ(code([](auto& j) { *j.add_outputs() = j.outputs(0); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) { j.add_frames(), j.add_frames(); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) { j.set_priority(101); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) { j.mutable_environment()->mutable_constant()->set_red(-1.0f); }),
              v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) {
                  v1::SceneFile& file = *j.mutable_scene()->mutable_files()->add_files();
                  file.set_path("a.glb");
                  file.mutable_content()->set_sha256(std::string(32, 'x'));
              }),
              v1::ERROR_CODE_MISSING_BLOBS);
    EXPECT_EQ(code([](auto&) {}), v1::ERROR_CODE_UNSPECIFIED);
}

TEST_F(RenderService, AKeyMakesOneJobAlsoAfterARestart)
{
    TestServer server(folder_.path());
    v1::Job job = small_job();
    job.set_idempotency_key("night");
    const auto number = Client(server.socket()).submit(job).job();
    server.restart_after(SIGKILL);
    const auto again = Client(server.socket()).submit(job);
    EXPECT_EQ(again.job(), number);
    EXPECT_TRUE(again.existed());
}

/// What a client without a library might send. @return all that comes back until the server closes
std::string talk(const std::string& socket, const std::string& bytes)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket.copy(address.sun_path, sizeof address.sun_path - 1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
    std::string answer;
    char part[4096];
    for (ssize_t count = 0; (count = ::recv(fd, part, sizeof part, 0)) > 0;)
        answer.append(part, static_cast<std::size_t>(count));
    ::close(fd);
    return answer;
}

TEST_F(RenderService, WhoSpeaksOtherwiseIsToldAndSentAway)
{
    TestServer server(folder_.path(), {"--message-seconds", "0.3"});
    const auto begin = Clock::now();
    EXPECT_NE(talk(server.socket(), "GET / HTTP/1.1\r\n\r\n").find("greeting"), std::string::npos);
    EXPECT_NE(talk(server.socket(), std::string("RCSP\0\7\0\0", 8)).find("version 7"), std::string::npos);
    EXPECT_NE(talk(server.socket(), service::greeting() + "\xff\xff\xff\xff\x0f").find("length"), std::string::npos);
    v1::Request list;
    list.mutable_list();
    EXPECT_NE(talk(server.socket(), service::greeting() + service::frame(list)).find("hello"), std::string::npos);
    talk(server.socket(), service::greeting() + "\x50half");  // never completed
    talk(server.socket(), "");                                // never says a word
    EXPECT_LT(seconds_since(begin), 5.0);
    EXPECT_EQ(Client(server.socket()).watch(Client(server.socket()).submit(small_job()).job()).state(),
              v1::JOB_STATE_COMPLETED);
}

TEST_F(RenderService, OneServerForASocketAndAStateFolder)
{
    TestServer server(folder_.path());
    const auto same_socket = rcsplat({"serve", "--socket", server.socket(), "--state", folder_ / "other"});
    EXPECT_EQ(same_socket.code, test::kFailure);
    EXPECT_NE(same_socket.err.find("another server listens"), std::string::npos) << same_socket.err;
    const auto same_state = rcsplat({"serve", "--socket", folder_ / "x/s", "--state", server.state()});
    EXPECT_NE(same_state.err.find("another server uses"), std::string::npos) << same_state.err;
    server.restart_after(SIGKILL);  // leaves its socket behind
    EXPECT_EQ(Client(server.socket()).server().max_message_bytes(), 1u << 20);
}

TEST_F(RenderService, ConfigurationIsCheckedAndReadAgain)
{
    const std::string file = folder_ / "config";
    test::write_bytes(file, "max-jobs = 0\n");
    EXPECT_EQ(rcsplat({"serve", "--config", file, "--check"}).code, test::kBadUsage);
    test::write_bytes(file, "colour = 3\n");
    EXPECT_EQ(rcsplat({"serve", "--config", file, "--check"}).code, test::kBadUsage);
    EXPECT_EQ(rcsplat({"serve", "--listen", "0.0.0.0:7000", "--check"}).code, test::kBadUsage) << "without TLS";
    EXPECT_EQ(rcsplat({"serve", "--root", folder_ / "none", "--check"}).code, test::kFailure);
    test::write_bytes(file, "max-megapixels = 1\n");
    EXPECT_EQ(rcsplat({"serve", "--config", file, "--check"}).code, 0);

    TestServer server(folder_.path(), {"--config", file});
    Client client(server.socket());
    v1::Job job = small_job(1100);
    EXPECT_EQ(code_of([&] { client.submit(job); }), v1::ERROR_CODE_LIMIT);
    test::write_bytes(file, "max-megapixels = 2\n");
    ::kill(server.pid(), SIGHUP);
    wait_until([&] { return server.log().find("event=reloaded") != std::string::npos; });
    client.cancel(client.submit(job).job());
    test::write_bytes(file, "max-megapixels = many\n");
    ::kill(server.pid(), SIGHUP);
    wait_until([&] { return server.log().find("event=not_reloaded") != std::string::npos; });
    client.cancel(client.submit(job).job());
}

TEST_F(RenderService, AnotherUserIsRefused)
{
    if (::getuid() != 0) GTEST_SKIP() << "only root can be somebody else";
    TestServer server(folder_.path());
    const auto as_nobody = [&](const std::string& what) {
        const pid_t pid = ::fork();
        if (pid == 0) {
            if (::setgroups(0, nullptr) != 0 || ::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
            int code = 0;
            try {
                Client client(server.socket());
            } catch (const ServiceError& e) {
                code = std::string(e.what()).find(what) != std::string::npos ? 7 : 8;
            }
            ::_exit(code);
        }
        int status = 0;
        ::waitpid(pid, &status, 0);
        return WEXITSTATUS(status);
    };
    EXPECT_EQ(as_nobody("Permission denied"), 7) << "by the folder";
    for (const std::string& path : {folder_.path(), folder_ / "run"}) ::chmod(path.c_str(), 0755);
    ::chmod(server.socket().c_str(), 0666);
    EXPECT_EQ(as_nobody("may not use"), 7) << "by the server";
}

TEST_F(RenderService, ListsAndCountsWhatItDid)
{
    TestServer server(folder_.path());
    const std::string a = folder_ / "a.png";
    ASSERT_EQ(rcsplat({"submit", "demo:cornell", "--size", "16x16", "-o", a, "--label", "shot=s1", "--server",
                       server.socket()})
                  .code,
              0);
    const auto list = rcsplat({"list", "--json", "--label", "shot=s1", "--server", server.socket()});
    const auto json = nlohmann::json::parse(list.out);
    ASSERT_EQ(json["jobs"].size(), 1u);
    EXPECT_EQ(json["jobs"][0]["state"], "JOB_STATE_COMPLETED");
    EXPECT_EQ(nlohmann::json::parse(
                  rcsplat({"list", "--json", "--label", "shot=s2", "--server", server.socket()}).out)["jobs"]
                  .size(),
              0u);
    EXPECT_NE(rcsplat({"stats", "--prometheus", "--server", server.socket()})
                  .out.find("\nrcsplat_frames_completed_total 1\n"),
              std::string::npos);
    const auto fetched = rcsplat({"fetch", "1", "-o", folder_ / "run", "--server", server.socket()});
    EXPECT_EQ(fetched.code, 0) << fetched.err;
    EXPECT_TRUE(bytes_of(folder_ / "run/a.png") == bytes_of(a));
    EXPECT_EQ(rcsplat({"fetch", "99", "--server", server.socket()}).code, test::kFailure);
    EXPECT_EQ(rcsplat({"list", "--server", folder_ / "nobody"}).code, test::kFailure);
}

}  // namespace
}  // namespace rcs
