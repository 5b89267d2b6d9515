// What the render service takes in, from whom, and what it refuses.

#include <cmath>
#include <csignal>
#include <filesystem>
#include <string>

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"
#include "wire/sha256.h"

namespace rcs::test {
namespace {

using service::Client;
using service::ServiceError;

TEST_F(RenderService, UploadsAreResumedAndNotRepeated)
{
    TestServer server(folder_.path());
    const std::string path = folder_ / "blob";
    write_bytes(path, std::string(1'500'000, 'b'));
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

TEST_F(RenderService, UploadsThatWereBrokenOffTakeNoPlaces)
{
    TestServer server(folder_.path());
    constexpr int kTwiceThePlaces = 128;
    for (int i = 0; i < kTwiceThePlaces; ++i) {
        v1::Request put;
        put.mutable_blob_put()->mutable_blob()->set_sha256(service::sha256(std::to_string(i)));
        put.mutable_blob_put()->mutable_blob()->set_size(1000);
        put.mutable_blob_put()->set_data("begun");
        ASSERT_EQ(Client(server.socket()).call(put).blob_put().held(), 5u) << i;
    }
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
    for (const char* layer : {"deep", "standard_error", "motion"}) {
        const auto keep = [&](auto& j) {
            j.mutable_outputs(0)->set_name("a.exr"), j.mutable_outputs(0)->add_layers(layer);
        };
        EXPECT_EQ(code(keep), v1::ERROR_CODE_BAD_ARGUMENT) << layer;
    }
    EXPECT_EQ(code([](auto& j) { j.add_frames()->mutable_motion()->set_time(std::nan("")); }),
              v1::ERROR_CODE_BAD_ARGUMENT);
    const auto blurred = [&](const auto& change) {
        return code([&](auto& j) {
            j.mutable_options()->set_aa(2), j.set_shutter_seconds(0.02), j.add_frames()->set_time(1.0);
            change(j);
        });
    };
    EXPECT_EQ(blurred([](auto&) {}), v1::ERROR_CODE_UNSPECIFIED);
    EXPECT_EQ(blurred([](auto& j) { j.mutable_frames(0)->clear_time(); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(blurred([](auto& j) { j.clear_frames(); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(blurred([](auto& j) { j.mutable_options()->set_aa(1); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(blurred([](auto& j) { j.set_shutter_seconds(-1.0); }), v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(blurred([](auto& j) {
                  j.mutable_outputs(0)->set_name("a.exr"), j.mutable_outputs(0)->add_layers("motion");
                  j.mutable_frames(0)->mutable_motion()->set_time(0.5);
              }),
              v1::ERROR_CODE_BAD_ARGUMENT);
    EXPECT_EQ(code([](auto& j) { j.mutable_camera_path()->add_keys(); }), v1::ERROR_CODE_BAD_ARGUMENT);
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
    EXPECT_EQ(same_socket.code, kFailure);
    EXPECT_NE(same_socket.err.find("another server listens"), std::string::npos) << same_socket.err;
    const auto same_state = rcsplat({"serve", "--socket", folder_ / "x/s", "--state", server.state()});
    EXPECT_NE(same_state.err.find("another server uses"), std::string::npos) << same_state.err;
    server.restart_after(SIGKILL);  // leaves its socket behind
    EXPECT_EQ(Client(server.socket()).server().max_message_bytes(), 1u << 20);
}

TEST_F(RenderService, ConfigurationIsCheckedAndReadAgain)
{
    const std::string file = folder_ / "config";
    write_bytes(file, "max-jobs = 0\n");
    EXPECT_EQ(rcsplat({"serve", "--config", file, "--check"}).code, kBadUsage);
    write_bytes(file, "colour = 3\n");
    EXPECT_EQ(rcsplat({"serve", "--config", file, "--check"}).code, kBadUsage);
    EXPECT_EQ(rcsplat({"serve", "--listen", "0.0.0.0:7000", "--check"}).code, kBadUsage) << "without TLS";
    EXPECT_EQ(rcsplat({"serve", "--root", folder_ / "none", "--check"}).code, kFailure);
    write_bytes(file, "max-megapixels = 1\n");
    EXPECT_EQ(rcsplat({"serve", "--config", file, "--check"}).code, 0);

    TestServer server(folder_.path(), {"--config", file});
    Client client(server.socket());
    v1::Job job = small_job(1100);
    EXPECT_EQ(code_of([&] { client.submit(job); }), v1::ERROR_CODE_LIMIT);
    v1::Job window = job;
    for (const int number : {1000, 1000, 100, 100}) window.mutable_options()->add_crop(number);
    EXPECT_EQ(client.watch(client.submit(window).job()).state(), v1::JOB_STATE_COMPLETED) << "what is rendered counts";
    write_bytes(file, "max-megapixels = 2\n");
    ::kill(server.pid(), SIGHUP);
    wait_until([&] { return server.log().find("event=reloaded") != std::string::npos; });
    client.cancel(client.submit(job).job());
    write_bytes(file, "max-megapixels = many\n");
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

}  // namespace
}  // namespace rcs::test
