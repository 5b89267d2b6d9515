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
    // The address sanitizer, where the program is built with it, else refuses to come after what is loaded before all.
    const char* sanitizer = std::getenv("ASAN_OPTIONS");
    const std::string before = sanitizer ? sanitizer : "";
    ::setenv("ASAN_OPTIONS", (before + ":verify_asan_link_order=0").c_str(), 1);
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
    ::setenv("ASAN_OPTIONS", before.c_str(), 1);
    EXPECT_EQ(server.log().find("timed_out"), std::string::npos) << server.log();
    EXPECT_EQ(server.log().find("event=expired"), std::string::npos) << server.log();
    EXPECT_EQ(server.log().find("took longer"), std::string::npos) << server.log();
    EXPECT_NE(server.log().find("time=2099-"), std::string::npos) << "the clock was set";
}

v1::HealthReply health_of(Client& client)
{
    v1::Request request;
    request.mutable_health();
    return client.call(request).health();
}

TEST_F(Night, LowSpaceLetsFramesWaitAndGoesOnByItself)
{
    const std::string file = folder_ / "config";
    write_bytes(file, "min-free = 0\n");
    TestServer server(folder_.path(), {"--config", file});
    Client client(server.socket());
    const auto first = client.submit(long_job()).job();
    wait_until_rendering(client, first);
    const auto waiting = client.submit(small_job()).job();
    write_bytes(file, "min-free = 1e9\n");
    ::kill(server.pid(), SIGHUP);
    wait_until([&] { return server.log().find("event=paused") != std::string::npos; });
    client.cancel(first);
    EXPECT_EQ(client.watch(first).state(), v1::JOB_STATE_CANCELLED);
    EXPECT_EQ(client.details(waiting).status().state(), v1::JOB_STATE_QUEUED);
    EXPECT_FALSE(health_of(client).serving());
    EXPECT_NE(health_of(client).message().find("disk is full"), std::string::npos) << health_of(client).message();
    v1::Request stats;
    stats.mutable_stats();
    EXPECT_EQ(client.call(stats).stats().values().at("rcsplat_paused_for_space"), 1.0);
    EXPECT_EQ(code_of([&] { client.submit(small_job()); }), v1::ERROR_CODE_UNAVAILABLE);
    write_bytes(file, "min-free = 0\n");
    ::kill(server.pid(), SIGHUP);
    EXPECT_EQ(client.watch(waiting).state(), v1::JOB_STATE_COMPLETED);
    EXPECT_NE(server.log().find("event=resumed"), std::string::npos);
}

TEST_F(Night, AFinishedPictureWaitsForRoomOnAFullDisk)
{
    if (std::system("unshare -rm mount -t tmpfs none /mnt >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "this user may not mount in a namespace";
    fs::create_directory(folder_ / "state");
    const std::string mount = "mount -t tmpfs -o size=24m none " + folder_ / "state" + R"( && exec "$0" "$@")";
    TestServer server(folder_.path(), {"--min-free", "2"}, {"unshare", "-rm", "sh", "-c", mount});
    Client client(server.socket());
    v1::Job job = small_job(256);
    job.mutable_options()->mutable_settings()->set_rays(2048);
    job.mutable_outputs(0)->set_name("a.exr");
    const auto number = client.submit(job).job(), next = client.submit(small_job()).job();
    wait_until_rendering(client, number);
    const std::string filler = "/proc/" + std::to_string(server.pid()) + "/root" + server.state() + "/filler";
    write_bytes(filler, std::string(32 << 20, 'x'));
    wait_until([&] { return server.log().find("event=picture_waits_for_space") != std::string::npos; });
    EXPECT_NE(health_of(client).message().find("waits for room"), std::string::npos) << health_of(client).message();
    EXPECT_EQ(client.details(number).status().state(), v1::JOB_STATE_RUNNING);
    fs::remove(filler);
    EXPECT_EQ(client.watch(number).state(), v1::JOB_STATE_COMPLETED);
    EXPECT_EQ(client.watch(next).state(), v1::JOB_STATE_COMPLETED);
    EXPECT_EQ(client.details(number).frames(0).attempts(), 1) << "it was rendered once";
    client.fetch(number, 0, "a.exr", folder_ / "a.exr");
}

TEST_F(Night, AWorkerThatHangsWhileItsPictureWaitsForRoomIsReplaced)
{
    if (std::system("unshare -rm mount -t tmpfs none /mnt >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "this user may not mount in a namespace";
    fs::create_directory(folder_ / "state");
    const std::string mount = "mount -t tmpfs -o size=24m none " + folder_ / "state" + R"( && exec "$0" "$@")";
    TestServer server(folder_.path(), {"--min-free", "2", "--worker-start", "3"},
                      {"unshare", "-rm", "sh", "-c", mount});
    Client client(server.socket());
    v1::Job job = small_job(200);
    job.mutable_options()->mutable_settings()->set_rays(1024);
    const auto number = client.submit(job).job();
    wait_until_rendering(client, number);
    const std::string filler = "/proc/" + std::to_string(server.pid()) + "/root" + server.state() + "/filler";
    write_bytes(filler, std::string(32 << 20, 'x'));
    wait_until([&] { return server.log().find("event=picture_waits_for_space") != std::string::npos; });
    ::kill(server.worker(), SIGSTOP);
    fs::remove(filler);
    EXPECT_EQ(client.watch(number).state(), v1::JOB_STATE_COMPLETED);
    EXPECT_EQ(client.details(number).frames(0).attempts(), 2);
}

TEST_F(Night, PicturesMayLieOnADiskOfTheirOwn)
{
    if (std::system("unshare -rm mount -t tmpfs none /mnt >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "this user may not mount in a namespace";
    const std::string results = folder_ / "state" + "/results";
    fs::create_directories(results);
    const std::string mount = "mount -t tmpfs -o size=4m none " + results + " && mkdir " + results +
                              "/1.0.unknown && echo x >" + results + R"(/1.0.unknown/a.png && exec "$0" "$@")";
    TestServer server(folder_.path(), {"--min-free", "8", "--recover"}, {"unshare", "-rm", "sh", "-c", mount});
    EXPECT_EQ(bytes_of(server.state() + "/aside/1.0.unknown/a.png"), "x\n") << server.log();
    Client client(server.socket());
    EXPECT_EQ(code_of([&] { client.submit(small_job()); }), v1::ERROR_CODE_UNAVAILABLE) << "it has 4 MB";
    EXPECT_NE(health_of(client).message().find("4 MB are free"), std::string::npos) << health_of(client).message();
}

TEST_F(Night, WhatNoWorkerCouldBeToldIsRefused)
{
    TestServer server(folder_.path());
    Client client(server.socket());
    v1::Job job = small_job();
    job.mutable_outputs(0)->set_name("a.exr");
    for (std::size_t bytes = 0; bytes < service::kMaxMessage - 1000; bytes += 10)
        job.mutable_outputs(0)->add_layers("indirect");
    ASSERT_LT(job.ByteSizeLong(), service::kMaxMessage);
    EXPECT_EQ(code_of([&] { client.submit(job); }), v1::ERROR_CODE_LIMIT);
    job = small_job();
    for (int i = 0; i < 9000; ++i) {
        job.add_frames()->set_number(i);
        job.mutable_frames(i)->set_camera_name(std::string(90, 'c'));
    }
    const auto many = client.submit(job).job();
    wait_until([&] { return client.details(many).status().frames_failed() > 0; });
    EXPECT_NE(client.details(many).status().error().message().find("ccc"), std::string::npos) << "it was handed over";
    client.cancel(many);
}

TEST_F(Night, AFrameThatCannotBeHandedOverSaysWhyAndHoldsNoWorker)
{
    fs::create_directory(folder_ / "root");
    fs::rename(scene_file("cornell"), folder_ / "root/gone.glb");
    TestServer server(folder_.path(), {"--workers", "1", "--root", folder_ / "root"});
    Client client(server.socket());
    v1::Request hold;
    hold.mutable_pause();
    client.call(hold);
    v1::Job job = small_job();
    job.mutable_scene()->set_path(folder_ / "root/gone.glb");
    const auto number = client.submit(job).job(), next = client.submit(small_job()).job();
    fs::remove(folder_ / "root/gone.glb");
    hold.mutable_pause()->set_resume(true);
    client.call(hold);
    const v1::JobStatus end = client.watch(number);
    EXPECT_EQ(end.state(), v1::JOB_STATE_FAILED);
    EXPECT_NE(end.error().message().find("gone.glb"), std::string::npos) << end.error().message();
    EXPECT_EQ(client.watch(next).state(), v1::JOB_STATE_COMPLETED);
}

TEST_F(Night, AWorkerThatHangsIsReplaced)
{
    TestServer server(folder_.path(), {"--worker-start", "3"});
    Client client(server.socket());
    wait_until([&] { return health_of(client).serving(); });
    EXPECT_EQ(rcsplat({"stats", "--health", "--server", server.socket()}).out,
              "serving: 1 workers, 0 busy, 0 frames wait\n");
    ::kill(server.worker(), SIGSTOP);
    const auto job = client.submit(small_job()).job();
    EXPECT_EQ(client.watch(job).state(), v1::JOB_STATE_COMPLETED);
    EXPECT_EQ(client.details(job).frames(0).attempts(), 2);
}

TEST_F(Night, WithoutAWorkerAServerIsNotWell)
{
    TestServer server(folder_.path(), {"--worker-start", "0.01"});
    Client client(server.socket());
    EXPECT_FALSE(health_of(client).serving());
    wait_until([&] { return health_of(client).message().find("was not ready after 0.01 s") != std::string::npos; });
    EXPECT_FALSE(health_of(client).serving());
    const Outcome told = rcsplat({"stats", "--health", "--server", server.socket()});
    EXPECT_EQ(told.code, 1);
    EXPECT_NE(told.err.find("not serving: workers do not start"), std::string::npos) << told.err;
}

TEST_F(Night, FailuresAreToldInTheUsersWords)
{
    TestServer server(folder_.path());
    write_bytes(folder_ / "broken.gltf", R"({"asset": {"version": "2.0"}, "meshes": 7})");
    const auto outcome = rcsplat(
        {"submit", folder_ / "broken.gltf", "--size", "16x16", "-o", folder_ / "a.png", "--server", server.socket()});
    EXPECT_EQ(outcome.code, kFailure);
    EXPECT_NE(outcome.err.find("broken.gltf"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find(server.state()), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace rcs::test
