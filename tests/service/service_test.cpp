// The render service as its users see it: a real server, real workers, real clients.

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"

namespace rcs::test {
namespace {

using service::Client;

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

TEST_F(RenderService, SkiesLensesAndCropsArriveToo)
{
    TestServer server(folder_.path());
    std::set<std::string> pictures;
    const std::vector<std::string> plain{"render", "demo:spheres", "--size", "32x32", "-q"};
    for (const std::vector<std::string>& more : {std::vector<std::string>{},
                                                 {"--environment", "none"},
                                                 {"--environment", "0.5,1,2"},
                                                 {"--lens-shift", "0.25,-0.5"},
                                                 {"--crop", "5,6,20,17"},
                                                 {"--f-stop", "0.1", "--focus", "2"},
                                                 {"--eye", "0,1,3", "--target", "0.2,0.8,0"}}) {
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
    EXPECT_EQ(pictures.size(), 7u) << "they differ";
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

TEST_F(RenderService, LayersOnDemandAreThoseOfALocalRender)
{
    const std::string scene = RCS_SCENES_DIR "/cornell-animated.glb";
    if (!std::filesystem::exists(scene)) GTEST_SKIP() << "needs " << scene;
    TestServer server(folder_.path());
    const std::vector<std::string> options{
        "--size",        "32x32", "--aa", "2", "-q", "--layers", "position,motion,CryptoObject,CryptoMaterial",
        "--motion-time", "-0.5"};
    const auto with = [&](std::vector<std::string> words) {
        words.insert(words.end(), options.begin(), options.end());
        return words;
    };
    const auto local = rcsplat(with({"render", scene, "--time", "1", "-o", folder_ / "local.exr"}));
    const auto remote =
        rcsplat(with({"render", scene, "--time", "1", "-o", folder_ / "remote.exr", "--server", server.socket()}));
    const auto frames = rcsplat(with(
        {"submit", scene, "--frames", "2-4x2", "--fps", "2", "-o", folder_ / "f.##.exr", "--server", server.socket()}));
    ASSERT_EQ(local.code + remote.code + frames.code, 0) << local.err << remote.err << frames.err;
    EXPECT_GT(bytes_of(folder_ / "local.exr").size(), 20000u);
    EXPECT_TRUE(bytes_of(folder_ / "remote.exr") == bytes_of(folder_ / "local.exr"));
    EXPECT_TRUE(bytes_of(folder_ / "f.02.exr") == bytes_of(folder_ / "local.exr")) << "frame 2 is at 1 s";
    EXPECT_FALSE(bytes_of(folder_ / "f.04.exr") == bytes_of(folder_ / "local.exr"));
}

TEST_F(RenderService, AMissingCameraFailsTheJobWithItsReason)
{
    TestServer server(folder_.path());
    const auto outcome = rcsplat(
        {"render", "demo:cornell", "--camera", "nowhere", "-o", folder_ / "a.png", "--server", server.socket(), "-q"});
    EXPECT_EQ(outcome.code, kFailure);
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
    const pid_t pid = start(logs, {"render", "demo:atrium", "--size", "2000x2000", "--aa", "64", "-o",
                                   folder_ / "a.png", "--server", server.socket()});
    Client client(server.socket());
    v1::Request list;
    list.mutable_list();
    wait_until([&] { return client.call(list).list().jobs_size() == 1; });
    ::kill(pid, SIGINT);
    EXPECT_EQ(finish(pid, logs).code, 130);
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
    EXPECT_EQ(rcsplat({"fetch", "99", "--server", server.socket()}).code, kFailure);
    EXPECT_EQ(rcsplat({"list", "--server", folder_ / "nobody"}).code, kFailure);
}

}  // namespace
}  // namespace rcs::test
