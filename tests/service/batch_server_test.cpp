// rcsplat batch --server: the frames of a batch by a render server, accounted for as those of one process.

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using service::Client;

class BatchOnServer : public RenderService {
protected:
    BatchOnServer()
    {
        write_bytes(folder_ / "walk.json",
                    R"({"fps": 10, "keys": [{"frame": 1, "eye": [0.0, 0.5, 3.0], "target": [0, 0, 0]},
                        {"frame": 10, "eye": [1.0, 0.5, 3.0], "target": [0, 0, 0]}]})");
    }

    std::vector<std::string> view() const
    {
        return {"--size", "24x24", "--aa", "2", "--rays", "16", "--camera-path", folder_ / "walk.json"};
    }
    std::vector<std::string> words(const std::vector<std::string>& more) const
    {
        std::vector<std::string> all{"batch", "demo:furnace", "--frames", "2-8x3",    "--fps",
                                     "10",    "-o",           pictures(), "--server", folder_ / "run/socket"};
        const std::vector<std::string> seen = view();
        all.insert(all.end(), seen.begin(), seen.end());
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    std::string pictures() const { return folder_ / "f.####.exr"; }
    json report() const { return json::parse(bytes_of(folder_ / "report.json")); }
    int count(const std::string& state) const { return report().at("counts").at(state); }

    /// Starts a batch at a server whose queue is held, and waits until its job is there.
    pid_t start_and_wait_for_job(const TestServer& server, const TemporaryFolder& logs)
    {
        EXPECT_EQ(rcsplat({"pause", "--queue", "--server", server.socket()}).code, 0);
        const pid_t pid = start(logs, words({}));
        Client client(server.socket());
        wait_until([&] { return jobs(client).jobs_size() == 1; });
        return pid;
    }
    static v1::ListReply jobs(Client& client)
    {
        v1::Request list;
        list.mutable_list();
        return client.call(list).list();
    }
};

TEST_F(BatchOnServer, MakesThePicturesOfRenderAndSkipsThoseThatAreDone)
{
    const TestServer server(folder_.path());
    for (const std::vector<std::string>& shutter : {std::vector<std::string>{}, {"--shutter", "0.9"}}) {
        std::vector<std::string> more{"--independent-frames", "-o", folder_ / "f.####.png"};
        more.insert(more.end(), shutter.begin(), shutter.end());
        const Outcome batch = rcsplat(words(more));
        EXPECT_EQ(batch.code, 0) << batch.err;
        EXPECT_EQ(count("rendered"), 3);
        for (const std::string digit : {"2", "5", "8"}) {
            std::vector<std::string> one{"render",          "demo:furnace", "--time",          "0." + digit, "-o",
                                         folder_ / "1.exr", "-o",           folder_ / "1.png", "-q"};
            const std::vector<std::string> seen = view();
            one.insert(one.end(), seen.begin(), seen.end());
            one.insert(one.end(), shutter.begin(), shutter.end());
            if (!shutter.empty()) one.insert(one.end(), {"--fps", "10"});
            EXPECT_EQ(rcsplat(one).code, 0);
            EXPECT_EQ(bytes_of(folder_ / ("f.000" + digit + ".exr")), bytes_of(folder_ / "1.exr")) << digit;
            EXPECT_EQ(bytes_of(folder_ / ("f.000" + digit + ".png")), bytes_of(folder_ / "1.png")) << digit;
        }
        EXPECT_EQ(rcsplat(words(more)).code, 0);
        EXPECT_EQ(count("kept"), 3);
    }
    fs::remove(folder_ / "f.0005.png");
    const Outcome again =
        rcsplat(words({"--independent-frames", "-o", folder_ / "f.####.png", "--shutter", "0.9", "--explain"}));
    EXPECT_NE(again.out.find("f.0005.png is missing"), std::string::npos) << again.out;
    EXPECT_EQ(count("rendered"), 1);
    for (const auto& entry : fs::directory_iterator(folder_ / ".rcsplat"))
        EXPECT_EQ(entry.path().extension(), ".json") << "nothing is left but what is known of frames";
}

TEST_F(BatchOnServer, ReportsAndFingerprintsAreThoseOfOneProcess)
{
    const TestServer server(folder_.path());
    const Outcome batch = rcsplat(words({}));
    EXPECT_EQ(batch.code, 0) << batch.err;
    const json frames = report().at("frames");
    EXPECT_EQ(report().at("server"), server.socket());
    EXPECT_TRUE(frames[0].at("figures").at("flicker").is_null()) << "there is no frame before it";
    double exposure = frames[0].at("figures").at("exposure");
    EXPECT_NE(exposure, 0.0);
    for (const json& frame : frames) {
        const json figures = frame.at("figures");
        EXPECT_GT(figures.at("cpu_seconds"), 0.0);
        EXPECT_GT(figures.at("rays"), 0);
        EXPECT_EQ(figures.at("exposure"), exposure) << "the first one's, or the film would flicker";
    }
    EXPECT_NE(bytes_of(folder_ / "report.html").find("by the render server at"), std::string::npos);
    EXPECT_NE(bytes_of(folder_ / "report.html").find("data:image/jpeg;base64,"), std::string::npos);

    std::vector<std::string> local = words({"--explain"});
    local.erase(std::find(local.begin(), local.end(), "--server"),
                std::find(local.begin(), local.end(), "--server") + 2);
    const Outcome here = rcsplat(local);
    EXPECT_NE(here.out.find("records of other frames was none, is used"), std::string::npos) << here.out;
    EXPECT_EQ(here.out.find("scene has changed"), std::string::npos) << "that has not changed: " << here.out;
    EXPECT_EQ(here.out.find("camera has changed"), std::string::npos) << here.out;
}

TEST_F(BatchOnServer, TellsTheChangeWhereTheCameraStands)
{
    const TestServer server(folder_.path());
    const Outcome batch = rcsplat({"batch", "demo:cornell", "--frames", "1-3", "--size", "16x16", "--aa", "1", "--rays",
                                   "16", "-o", pictures(), "--server", server.socket()});
    EXPECT_EQ(batch.code, 0) << batch.err;
    const json frames = report().at("frames");
    EXPECT_TRUE(frames[0].at("figures").at("flicker").is_null());
    EXPECT_EQ(frames[1].at("figures").at("flicker"), 0.0) << "the same picture again";
    EXPECT_EQ(frames[2].at("figures").at("flicker"), 0.0);
}

TEST_F(BatchOnServer, AFrameThatFailsDoesNotStopTheOthers)
{
    const TestServer server(folder_.path());
    write_bytes(folder_ / "walk.json",
                R"({"fps": 10, "keys": [{"frame": 1, "eye": [0.0, 0.5, 3.0], "target": [0, 0, 0]},
                    {"frame": 4, "camera": "nobody"}, {"frame": 7, "eye": [1, 1, 3], "target": [0, 0, 0]}]})");
    const Outcome batch = rcsplat(words({}));
    EXPECT_EQ(batch.code, 1) << batch.err;
    EXPECT_EQ(count("rendered"), 2);
    EXPECT_EQ(count("failed"), 1);
    EXPECT_NE(report().at("frames")[1].at("error").get<std::string>().find("nobody"), std::string::npos);

    const Outcome late = rcsplat({"batch", "demo:cornell", "--frames", "2-8x3", "--size", "1000x1000", "--aa", "16",
                                  "-o", pictures(), "--server", server.socket(), "--time-limit", "0.01"});
    EXPECT_EQ(late.code, 1);
    EXPECT_EQ(count("failed"), 3);
    EXPECT_NE(report().at("frames")[0].at("error").get<std::string>().find("longer than the limit"), std::string::npos)
        << report();
    EXPECT_NE(report().at("frames")[0].at("log").get<std::string>().find('\n'), std::string::npos) << "of its worker";
    EXPECT_TRUE(fs::exists(folder_ / ".rcsplat/f.0002.exr.json")) << "of the files that are there";
    EXPECT_FALSE(fs::exists(folder_ / ".rcsplat/f.0002.exr.json.job"));
}

TEST_F(BatchOnServer, GoesOnWithTheJobOfARunThatWasKilled)
{
    const TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = start_and_wait_for_job(server, logs);
    ::kill(pid, SIGKILL);
    finish(pid, logs);
    EXPECT_TRUE(fs::exists(folder_ / ".rcsplat/f.0002.exr.json.job"));
    EXPECT_EQ(rcsplat({"resume", "--queue", "--server", server.socket()}).code, 0);
    const Outcome batch = rcsplat(words({}));
    EXPECT_EQ(batch.code, 0) << batch.err;
    EXPECT_EQ(count("rendered"), 3);
    Client client(server.socket());
    int frames = 0;
    const v1::ListReply all = jobs(client);
    for (const v1::JobStatus& job : all.jobs()) frames += job.frames();
    EXPECT_EQ(frames, 3) << "none was asked for twice";
    for (const auto& entry : fs::directory_iterator(folder_ / ".rcsplat")) EXPECT_EQ(entry.path().extension(), ".json");
}

TEST_F(BatchOnServer, AsksAnewWhereAnOptionHasChangedMeanwhile)
{
    const TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = start_and_wait_for_job(server, logs);
    ::kill(pid, SIGKILL);
    finish(pid, logs);
    EXPECT_EQ(rcsplat({"resume", "--queue", "--server", server.socket()}).code, 0);
    EXPECT_EQ(rcsplat(words({"--bounces", "2", "--exposure", "1"})).code, 0);
    Client client(server.socket());
    EXPECT_EQ(jobs(client).jobs(0).frames(), 3) << "those of before are of other options";
}

TEST_F(BatchOnServer, OutlivesItsServer)
{
    TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = start_and_wait_for_job(server, logs);
    server.restart_after(SIGKILL);
    EXPECT_EQ(rcsplat({"resume", "--queue", "--server", server.socket()}).code, 0);
    const Outcome batch = finish(pid, logs);
    EXPECT_EQ(batch.code, 0) << batch.err;
    EXPECT_NE(batch.err.find("the server is back"), std::string::npos) << batch.err;
    EXPECT_EQ(count("rendered"), 3);
}

TEST_F(BatchOnServer, ASignalEndsTheJobInOrder)
{
    const TestServer server(folder_.path());
    const TemporaryFolder logs;
    const pid_t pid = start_and_wait_for_job(server, logs);
    ::kill(pid, SIGTERM);
    const Outcome ended = finish(pid, logs);
    EXPECT_EQ(ended.code, 143) << ended.err;
    EXPECT_EQ(count("left"), 3);
    Client client(server.socket());
    EXPECT_EQ(jobs(client).jobs(0).state(), v1::JOB_STATE_CANCELLED);
    EXPECT_EQ(rcsplat({"resume", "--queue", "--server", server.socket()}).code, 0);
    EXPECT_EQ(rcsplat(words({})).code, 0);
    EXPECT_EQ(count("rendered"), 3);
}

TEST_F(BatchOnServer, SaysThatNobodyAnswers)
{
    const Outcome batch = rcsplat(words({}));
    EXPECT_EQ(batch.code, 75);
    EXPECT_NE(batch.err.find("no server answers"), std::string::npos) << batch.err;
    EXPECT_FALSE(fs::exists(folder_ / "f.0002.exr"));
    EXPECT_EQ(rcsplat(words({"--dry-run"})).code, 0) << "that needs none";
    expect_error(words({"--threads", "2"}), kBadUsage, "--threads excludes --server", folder_);
}

}  // namespace
}  // namespace rcs::test
