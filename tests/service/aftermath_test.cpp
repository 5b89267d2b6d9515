// What follows frames and jobs that have ended: deliveries, and the operator's command.

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "support/rcsplat.h"
#include "support/render_service.h"
#include "support/server.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using service::Client;

class Aftermath : public RenderService {
protected:
    void SetUp() override { fs::create_directory(folder_ / "out"); }
    std::string script(const std::string& name, const std::string& text)
    {
        const std::string path = folder_ / name;
        std::ofstream(path) << "#!/bin/sh\n" << text;
        fs::permissions(path, fs::perms::owner_all);
        return path;
    }
    static std::multiset<std::string> lines_of(const std::string& path)
    {
        std::ifstream file(path);
        std::multiset<std::string> lines;
        for (std::string line; std::getline(file, line);) lines.insert(line);
        return lines;
    }
    /// Two frames of a small picture, with names as submit gives them.
    v1::Job job(const std::string& deliver)
    {
        v1::Job asked = small_job();
        asked.mutable_outputs(0)->set_file_name("f.####.png");
        for (const int number : {1, 2}) asked.add_frames()->set_number(number);
        asked.set_deliver(deliver);
        return asked;
    }
};

TEST_F(Aftermath, PicturesAreDeliveredUnderTheNamesThatFetchGivesThem)
{
    TestServer server(folder_.path(), {"--workers", "1", "--deliver-root", folder_ / "out"});
    Client client(server.socket());
    const auto number = client.submit(job("shots/a")).job();
    client.watch(number);
    wait_until([&] { return client.details(number).status().frames_delivered() == 2; });
    for (const int frame : {1, 2}) {
        client.fetch(number, frame, "a.png", folder_ / "fetched.png");
        EXPECT_TRUE(bytes_of(folder_ / "out/shots/a/f.000" + std::to_string(frame) + ".png") ==
                    bytes_of(folder_ / "fetched.png"));
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out/shots/a"), {}), 2) << "nothing half is left";
    EXPECT_TRUE(client.details(number).frames(0).delivered());
}

TEST_F(Aftermath, OnlyBeneathTheRootAndThroughNoLinks)
{
    TestServer server(folder_.path(), {"--workers", "1", "--deliver-root", folder_ / "out"});
    Client client(server.socket());
    for (const char* folder : {"/etc", "../elsewhere", "a/../../b", "/"})
        EXPECT_EQ(code_of([&] { client.submit(job(folder)); }), v1::ERROR_CODE_FORBIDDEN) << folder;
    fs::create_directory(folder_ / "elsewhere");
    fs::create_symlink(folder_ / "elsewhere", folder_ / "out/link");
    const auto number = client.submit(job("link")).job();
    EXPECT_EQ(client.watch(number).state(), v1::JOB_STATE_COMPLETED) << "the pictures are here";
    wait_until([&] { return !client.details(number).status().delivery_error().empty(); });
    EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
    fs::create_directory(folder_ / "none");
    TestServer none(folder_ / "none", {"--workers", "1"});
    EXPECT_EQ(code_of([&] { Client(none.socket()).submit(job("a")); }), v1::ERROR_CODE_FORBIDDEN);
}

TEST_F(Aftermath, WhatCouldNotBeDeliveredIsAfterARestart)
{
    TestServer server(folder_.path(), {"--workers", "1", "--deliver-root", folder_ / "out"});
    std::ofstream(folder_ / "out/a") << "in the way";
    const auto number = Client(server.socket()).submit(job("a")).job();
    Client(server.socket()).watch(number);
    wait_until([&] { return !Client(server.socket()).details(number).status().delivery_error().empty(); });
    fs::remove(folder_ / "out/a");
    server.restart_after(SIGKILL);
    Client client(server.socket());
    wait_until([&] { return client.details(number).status().frames_delivered() == 2; });
    EXPECT_EQ(client.details(number).status().delivery_error(), "");
    EXPECT_TRUE(fs::exists(folder_ / "out/a/f.0002.png"));
}

TEST_F(Aftermath, TheOperatorsCommandHearsOfEachJobThatHasEnded)
{
    const std::string command =
        script("heard", "echo \"$RCSPLAT_JOB $RCSPLAT_STATE $RCSPLAT_COMPLETED\" >> " + (folder_ / "told") + "\n");
    TestServer server(folder_.path(), {"--workers", "1", "--on-completion", command});
    Client client(server.socket());
    const auto good = client.submit(job("")).job();
    v1::Job asked = small_job();
    asked.add_frames()->set_camera_name("$(touch nowhere)");
    const auto bad = client.submit(asked).job();
    client.watch(good);
    client.watch(bad);
    // They are told of side by side, in no order.
    const std::multiset<std::string> expected{std::to_string(good) + " completed 2", std::to_string(bad) + " failed 0"};
    wait_until([&] { return lines_of(folder_ / "told").size() >= expected.size(); });
    server.restart_after(SIGTERM);  // which waits for the programs that are about to end
    EXPECT_EQ(lines_of(folder_ / "told"), expected) << "once each";
}

TEST_F(Aftermath, ACommandThatHangsHoldsNobodyUpAndIsKilled)
{
    const std::string command = script("hang", "echo $$ > " + (folder_ / "pid") + "\nsleep 1000\n");
    TestServer server(folder_.path(), {"--workers", "1", "--on-completion", command, "--on-completion-seconds", "2"});
    Client client(server.socket());
    for (int i = 0; i < 6; ++i)
        EXPECT_EQ(client.watch(client.submit(small_job()).job()).state(), v1::JOB_STATE_COMPLETED);
    wait_until([&] { return server.log().find("took_too_long=1") != std::string::npos; });
}

}  // namespace
}  // namespace rcs::test
