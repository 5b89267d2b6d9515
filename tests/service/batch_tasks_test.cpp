// A batch in tasks: which frames each does, what a farm is given, and the pace towards a deadline.

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "batch/farm.h"
#include "batch/pace.h"
#include "batch/tasks.h"
#include "rcs/error.h"

namespace rcs::service {
namespace {

using Frames = std::vector<int>;

Frames numbers(int count)
{
    Frames frames;
    for (int i = 1; i <= count; ++i) frames.push_back(i);
    return frames;
}

TEST(Tasks, AreSaidInWords)
{
    EXPECT_EQ(parse_task("").kind, TaskKind::all);
    EXPECT_EQ(parse_task("report").kind, TaskKind::report);
    EXPECT_EQ(parse_task("overture/6").kind, TaskKind::overture);
    EXPECT_EQ(parse_task("overture/6").parts, 6);
    EXPECT_EQ(parse_task("3/6").kind, TaskKind::part);
    EXPECT_EQ(parse_task("3/6").part, 3);
    for (const char* text : {"7/6", "0/6", "1/0", "overture", "3", "/6", "3/", "reports", "-1/6"})
        EXPECT_THROW(parse_task(text), Error) << text;
}

TEST(Tasks, PartEachFrameOnce)
{
    for (const int count : {1, 7, 48, 50}) {
        for (int parts = 1; parts <= count; ++parts) {
            Frames joined;
            std::size_t least = 1000, most = 0;
            for (int part = 1; part <= parts; ++part) {
                const Frames frames = frames_of({TaskKind::part, part, parts}, numbers(count));
                least = std::min(least, frames.size());
                most = std::max(most, frames.size());
                joined.insert(joined.end(), frames.begin(), frames.end());
            }
            EXPECT_EQ(joined, numbers(count));
            EXPECT_LE(most, least + 1);
        }
    }
    EXPECT_EQ(count_parts(48, 8), 6);
    EXPECT_EQ(count_parts(50, 8), 7);
    EXPECT_EQ(count_parts(1, 8), 1);
    EXPECT_THROW(frames_of({TaskKind::part, 1, 8}, numbers(7)), Error);
}

TEST(Tasks, BeginWithAnOvertureAsLongAsAPart)
{
    EXPECT_EQ(frames_of({TaskKind::overture, 1, 6}, numbers(48)), (Frames{1, 9, 17, 25, 33, 41}));
    EXPECT_EQ(frames_of({TaskKind::overture, 1, 12}, numbers(24)), (Frames{1, 13}));
    EXPECT_EQ(frames_of({TaskKind::overture, 1, 1}, numbers(24)), (Frames{1}));
    EXPECT_EQ(frames_of({TaskKind::report}, numbers(3)), numbers(3));
}

FarmJob job_of(Engine engine)
{
    FarmJob job;
    job.engine = engine;
    job.name = "rcsplat-x";
    job.folder = "/the 'job'";
    job.directory = "/a b";
    job.words = {"/bin/rcsplat", "batch", "it's $HOME.glb"};
    job.parts = 6;
    return job;
}

TEST(Farm, QuotesWhatAShellWouldRead)
{
    const auto files = farm_files(job_of(Engine::local));
    EXPECT_EQ(files.size(), 2u);
    EXPECT_NE(files.at("task").find(R"('/bin/rcsplat' 'batch' 'it'\''s $HOME.glb' --task "$1" &)"), std::string::npos);
    EXPECT_NE(files.at("task").find("cd '/a b' || exit 73"), std::string::npos);
    EXPECT_NE(farm_files(job_of(Engine::slurm)).at("submit").find(R"(cd '/the '\''job'\''')"), std::string::npos);
}

TEST(Farm, LetsTasksWaitForEachOther)
{
    FarmJob job = job_of(Engine::slurm);
    std::string submit = farm_files(job).at("submit");
    EXPECT_NE(submit.find("--dependency=afterany:\"${overture%%;*}\" --array=1-6"), std::string::npos) << submit;
    EXPECT_NE(submit.find("--dependency=afterany:\"${frames%%;*}\""), std::string::npos) << submit;
    job.overture = false;
    submit = farm_files(job).at("submit");
    EXPECT_EQ(submit.find("${overture%%;*}"), std::string::npos) << submit;
    job.engine = Engine::openjd;
    EXPECT_EQ(farm_files(job).at("template.yaml").find("Overture"), std::string::npos);
    job.overture = true;
    EXPECT_NE(farm_files(job).at("template.yaml").find("dependsOn: Overture"), std::string::npos);
    job.engine = Engine::slurm;
    job.parts = 1001;
    EXPECT_THROW(farm_files(job), Error);
}

TEST(Deadline, IsATimeOfDayADateOrFromNow)
{
    setenv("TZ", "UTC", 1);
    constexpr std::int64_t kNow = 1'795'000'000'000;  // 2026-11-18T11:06:40Z
    EXPECT_EQ(seconds_until("+10m", kNow), 600.0);
    EXPECT_EQ(seconds_until("+1d2h3m4s", kNow), 86400 + 7384.0);
    EXPECT_EQ(seconds_until("11:07", kNow), 20.0);
    EXPECT_EQ(seconds_until("11:06", kNow), 86400 - 40.0) << "tomorrow";
    EXPECT_EQ(seconds_until("11:06:41", kNow + 250), 0.75);
    EXPECT_EQ(seconds_until("2026-11-18T12:06:40", kNow), 3600.0);
    EXPECT_EQ(seconds_until("2026-11-18T12:06:40+01:00", kNow - 5000), 5.0);
    EXPECT_EQ(seconds_until("2026-11-18T11:07Z", kNow), 20.0);
    for (const char* text : {"", "+", "+0s", "10m", "24:00", "06:60", "6", "2026-11-18T11:06Z", "2026-02-30T06:00Z",
                             "2026-13-01T06:00Z", "tomorrow"})
        EXPECT_THROW(seconds_until(text, kNow), Error) << text;
}

TEST(Pace, AimsAtWhatTheTimeAllows)
{
    Pace pace;
    EXPECT_FALSE(pace.knows());
    Forecast forecast;  // 0.04 / error^2 seconds
    for (const double error : {0.2, 0.1, 0.05, 0.03, 0.02, 0.01})
        forecast.points.push_back({error, 0.04 / error / error});
    pace.learn(forecast);
    for (const double error : {0.19, 0.07, 0.01, 0.004}) {
        EXPECT_NEAR(pace.seconds_to(error), 0.04 / error / error, 1e-9 / error / error);
        EXPECT_NEAR(pace.error_in(0.04 / error / error), error, 1e-6);
    }
    pace.learn(0.1, 8.0);
    EXPECT_NEAR(pace.seconds_to(0.1), 8.0, 1e-9) << "twice as long as it was forecast";
    pace.learn(0.1, 2.0);
    EXPECT_NEAR(pace.seconds_to(0.1), 4.0, 1e-9) << "one that is odd counts half";
    EXPECT_EQ(pace.error_in(1e-6), Pace::kMostError);
}

TEST(Pace, FramesThatShareRecordsAreBetterInTheSameTime)
{
    Pace pace;
    Forecast forecast;  // a second, and rays
    for (const double error : {0.2, 0.1, 0.05, 0.03, 0.02, 0.01})
        forecast.points.push_back({error, 1.0 + 0.04 / error / error});
    pace.learn(forecast);
    constexpr double kSeconds = 480.0;
    const double alone = pace.error_in(kSeconds / 48.0), shared = pace.error_of_shot(kSeconds, 48);
    EXPECT_LT(shared, 0.5 * alone);
    EXPECT_LT(pace.error_of_shot(2.0 * kSeconds, 48), shared);
    EXPECT_EQ(pace.error_of_shot(48.0, 48), Pace::kMostError) << "no time beside the frames";
}

}  // namespace
}  // namespace rcs::service
