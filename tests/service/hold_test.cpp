// Holding, trying again and looking at jobs, as their users do it.

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

class Hold : public RenderService {
protected:
    Outcome ask(std::vector<std::string> words)
    {
        words.insert(words.end(), {"--server", server_.socket()});
        return rcsplat(words);
    }
    /// @return its number
    std::string submit(const std::vector<std::string>& more)
    {
        std::vector<std::string> words{"submit", "demo:cornell",        "--size", "16x16", "--aa", "1", "--detach",
                                       "-o",     folder_ / "f.####.png"};
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = ask(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.out.substr(4, outcome.out.find('\n') - 4);
    }
    nlohmann::json jobs(std::vector<std::string> more)
    {
        more.insert(more.begin(), {"list", "--json"});
        const Outcome outcome = ask(more);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return nlohmann::json::parse(outcome.out).value("jobs", nlohmann::json::array());
    }

    TestServer server_{folder_.path(), {"--workers", "1"}};
};

TEST_F(Hold, APausedQueueAndAPausedJobWait)
{
    EXPECT_EQ(ask({"pause", "--queue"}).out, "the queue is paused\n");
    EXPECT_EQ(ask({"pause"}).code, kBadUsage);
    const std::string job = submit({"--frames", "1-2"});
    EXPECT_EQ(ask({"pause", job}).out, "job " + job + " paused\n");
    EXPECT_EQ(ask({"pause", job}).out, "job " + job + " paused, as it was\n");
    EXPECT_EQ(ask({"resume", "--queue"}).out, "the queue goes on\n");
    const std::string other = submit({});
    EXPECT_EQ(ask({"watch", other}).code, 0) << "it does not wait for the one that is held";
    EXPECT_EQ(jobs({"--state", "paused"}).at(0).at("job"), job);
    EXPECT_EQ(ask({"priority", job, "50"}).out, "job " + job + " has priority 50, 0 before\n");
    EXPECT_EQ(ask({"resume", job}).code, 0);
    EXPECT_EQ(ask({"watch", job}).code, 0);
    EXPECT_NE(ask({"pause", job}).err.find("has ended"), std::string::npos);
}

TEST_F(Hold, WhatFailedIsTriedAgainAndTellsWhy)
{
    const std::string job =
        submit({"--frames", "1-6", "--camera", "nowhere", "--stop-after", "2", "--label", "shot=a"});
    EXPECT_EQ(ask({"watch", job}).code, 1) << "as submit would";
    const auto failed = jobs({"--state", "failed", "--label", "shot=a"});
    ASSERT_EQ(failed.size(), 1u);
    EXPECT_EQ(failed[0].at("frames_failed"), 2);
    EXPECT_EQ(failed[0].at("frames_cancelled"), 4);
    EXPECT_NE(failed[0].at("error").at("message").get<std::string>().find("stopped after 2"), std::string::npos);
    EXPECT_TRUE(jobs({"--state", "completed"}).empty());
    EXPECT_TRUE(jobs({"--owner", "uid:77"}).empty());
    EXPECT_EQ(jobs({"--owner", failed[0].at("owner")}).size(), 1u);
    EXPECT_EQ(ask({"list", "--state", "lost"}).code, kBadUsage);

    EXPECT_NE(ask({"retry", job, "--frames", "2,5"}).out.find("2 frames wait again"), std::string::npos);
    EXPECT_EQ(ask({"watch", job}).code, kFailure);
    const Outcome logs = ask({"logs", job, "--frame", "2"});
    EXPECT_EQ(logs.code, 0) << logs.err;
    const std::size_t first = logs.out.find("started, worker ");
    ASSERT_NE(first, std::string::npos) << logs.out;
    EXPECT_NE(logs.out.find("started, worker ", first + 1), std::string::npos) << "both tries: " << logs.out;
    EXPECT_NE(logs.out.find("nowhere"), std::string::npos) << logs.out;
    EXPECT_NE(ask({"logs", job}).out.find("frame 1 "), std::string::npos);
    EXPECT_EQ(ask({"logs", job, "--frame", "99"}).code, kFailure);
}

TEST_F(Hold, AJobStartsWhenTheOneBeforeHasCompleted)
{
    EXPECT_EQ(ask({"pause", "--queue"}).code, 0);
    const std::string first = submit({}), second = submit({"--after", first, "--priority", "100"});
    const std::string bad = submit({"--camera", "nowhere"}), never = submit({"--after", bad});
    EXPECT_EQ(ask({"resume", "--queue"}).code, 0);
    EXPECT_EQ(ask({"watch", second}).code, 0);
    Client client(server_.socket());
    const auto ended = client.details(std::stoull(first)).status().finished_ms();
    EXPECT_GE(client.details(std::stoull(second)).status().started_ms(), ended);
    EXPECT_NE(ask({"watch", never}).err.find("job " + bad + ", which it waits for, failed"), std::string::npos);
    EXPECT_NE(ask({"submit", "demo:cornell", "--after", "999", "-o", folder_ / "a.png"}).code, 0);
}

}  // namespace
}  // namespace rcs::test
