// A queue whose database is lost or damaged.
#include "queue/salvage.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "queue/job_queue.h"
#include "support/temporary_folder.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

namespace fs = std::filesystem;

constexpr Moment kNow{1'000'000, 5000};

/// A state folder with jobs 1 to 20 of three frames each; the first frame of each is rendered.
class Salvage : public ::testing::Test {
protected:
    void SetUp() override
    {
        fs::create_directory(folder_ / "results");
        JobQueue queue(folder_.path(), {}, kNow);
        for (int i = 1; i <= 20; ++i) {
            v1::Job job;
            job.mutable_scene()->set_builtin("demo:cornell");
            job.mutable_scene()->set_label("scene " + std::string(200, 'x'));
            for (int f = 0; f < 3; ++f) job.add_frames()->set_number(f);
            job.set_idempotency_key(std::to_string(i));
            const auto number = queue.submit(job, "uid:1", "scene", {"blob"}, kNow).job;
            const std::string folder = "results/" + std::to_string(number) + ".0.x";
            fs::create_directory(folder_ / folder);
            test::write_bytes(folder_ / folder + "/a.png", "picture");
            v1::OutputFile file;
            file.set_name("a.png");
            file.set_size(7);
            queue.start({number, 0}, folder, kNow);
            queue.complete({number, 0}, {folder, {file}, "{}", {}, 0.0}, kNow);
            queue.commit();
        }
    }
    std::string refusal()
    {
        try {
            JobQueue(folder_.path(), {}, kNow);
        } catch (const ServiceError& e) {
            EXPECT_EQ(e.code(), v1::ERROR_CODE_BAD_FILE) << e.what();
            return e.what();
        }
        return "";
    }
    std::uint64_t next_number()
    {
        JobQueue queue(folder_.path(), {}, kNow);
        v1::Job job;
        const auto number = queue.submit(job, "uid:2", "scene", {}, kNow).job;
        queue.roll_back();
        return number;
    }
    /// Overwrites a page of the database, as a bad disk does.
    void damage(std::size_t page)
    {
        std::string bytes = test::bytes_of(folder_ / "queue.db");
        ASSERT_GT(bytes.size(), (page + 1) * 4096);
        bytes.replace(page * 4096, 4096, 4096, '\x5a');
        test::write_bytes(folder_ / "queue.db", bytes);
    }

    test::TemporaryFolder folder_;
};

TEST_F(Salvage, AWholeQueueIsTakenAsItIs) { EXPECT_EQ(refusal(), ""); }

TEST_F(Salvage, ALostDatabaseIsNotTakenForANewOne)
{
    fs::remove(folder_ / "queue.db");
    EXPECT_NE(refusal().find("is lost; started with --recover"), std::string::npos) << refusal();
    test::write_bytes(folder_ / "queue.db", "");
    EXPECT_NE(refusal().find("is empty"), std::string::npos) << refusal();
    fs::remove_all(folder_ / "results");
    EXPECT_NE(refusal(), "") << "the marker tells of it too";
    const Salvaged done = salvage_queue(folder_.path(), kNow);
    EXPECT_EQ(done.jobs, 0u);
    EXPECT_EQ(refusal(), "");
    EXPECT_GT(next_number(), 20u) << "numbers are not given twice";
}

TEST_F(Salvage, PicturesAloneTellOfTheirNumbers)
{
    for (const char* name : {"queue.db", "marker"}) fs::remove(folder_ / name);
    EXPECT_NE(refusal().find("is lost"), std::string::npos);
    salvage_queue(folder_.path(), kNow);
    EXPECT_EQ(next_number(), 21u);
    EXPECT_EQ(test::bytes_of(folder_ / "results/7.0.x/a.png"), "picture");
}

TEST_F(Salvage, ADatabaseOfElsewhereIsRefused)
{
    const test::TemporaryFolder other;
    fs::create_directory(other / "results");
    JobQueue(other.path(), {}, kNow);
    fs::copy(other / "queue.db", folder_ / "queue.db", fs::copy_options::overwrite_existing);
    EXPECT_NE(refusal().find("another state folder"), std::string::npos) << refusal();
    fs::remove(folder_ / "marker");
    EXPECT_NE(refusal().find("marker"), std::string::npos) << refusal();
}

TEST_F(Salvage, OtherTablesAreRefused)
{
    Database(folder_ / "queue.db").run("DROP INDEX frames_by_state");
    EXPECT_NE(refusal().find("tables of its version"), std::string::npos) << refusal();
}

TEST_F(Salvage, EveryDamagedPageIsFoundAndTheRestIsKept)
{
    const std::string whole = test::bytes_of(folder_ / "queue.db");
    const std::size_t pages = whole.size() / 4096;
    std::uint64_t most = 0;
    for (std::size_t page = 0; page + 1 < pages; page += 3) {
        test::write_bytes(folder_ / "queue.db", whole);
        damage(page);
        EXPECT_NE(refusal().find("damaged"), std::string::npos) << "page " << page << ": " << refusal();
        const Salvaged done = salvage_queue(folder_.path(), kNow);
        EXPECT_EQ(refusal(), "") << "page " << page;
        most = std::max(most, done.jobs);
        EXPECT_GT(next_number(), 20u) << "page " << page;
        JobQueue queue(folder_.path(), {}, kNow);
        v1::ListRequest all;
        all.set_limit(1000);
        const v1::ListReply list = queue.list(all, "");
        for (const v1::JobStatus& status : list.jobs()) {
            EXPECT_EQ(status.frames(), 3);
            v1::JobRequest request;
            request.set_job(status.job());
            EXPECT_EQ(queue.details(request).frames_size(), 3) << "page " << page;
        }
    }
    EXPECT_EQ(most, 20u) << "where an index alone was damaged";
}

TEST_F(Salvage, AFlippedBitOfACellIsFound)
{
    const std::string triggers = [&] {
        Database database(folder_ / "queue.db");
        Statement row(database,
                      "SELECT sql FROM sqlite_master WHERE type='trigger' AND name LIKE '%_changed' AND "
                      "tbl_name IN ('jobs', 'frames', 'files', 'job_blobs')");
        std::string text;
        while (row.step()) text += row.text(0) + ";";
        return text;
    }();
    for (const char* cell :
         {"UPDATE jobs SET priority=priority+4 WHERE id=7", "UPDATE jobs SET owner='uid:3' WHERE id=8",
          "UPDATE jobs SET spec=zeroblob(9) WHERE id=9", "UPDATE frames SET state=5 WHERE job=10 AND idx=1",
          "UPDATE frames SET estimate=1e-300 WHERE job=11 AND idx=1", "UPDATE files SET size=6 WHERE job=12",
          "UPDATE job_blobs SET digest='blub' WHERE job=13"}) {
        EXPECT_EQ(refusal(), "");
        {
            Database database(folder_ / "queue.db");
            database.run(
                "BEGIN; DROP TRIGGER jobs_changed; DROP TRIGGER frames_changed; DROP TRIGGER files_changed;"
                "DROP TRIGGER job_blobs_changed");
            database.run(cell);
            database.run(triggers.c_str());
            database.run("COMMIT");
        }
        EXPECT_NE(refusal().find("is not as it was written"), std::string::npos) << cell << ": " << refusal();
        salvage_queue(folder_.path(), kNow);
    }
}

TEST_F(Salvage, AFrameWithoutItsPictureIsRenderedAgain)
{
    fs::remove(folder_ / "results/3.0.x/a.png");
    Database(folder_ / "queue.db").run("DROP INDEX frames_by_state");
    const Salvaged done = salvage_queue(folder_.path(), kNow);
    EXPECT_EQ(done.jobs, 20u);
    EXPECT_EQ(done.frames, 60u);
    EXPECT_EQ(done.again, 1u);
    JobQueue queue(folder_.path(), {}, kNow);
    EXPECT_EQ(queue.status(3)->frames_completed(), 0);
    EXPECT_EQ(queue.status(4)->frames_completed(), 1);
    EXPECT_EQ(queue.count(v1::FRAME_STATE_QUEUED), 41u);
    EXPECT_EQ(queue.file({4, 0}, "a.png")->second, "results/4.0.x/a.png");
    EXPECT_TRUE(fs::exists(folder_ / "aside"));
    v1::Job again;
    again.set_idempotency_key("4");
    EXPECT_THROW(queue.submit(again, "uid:1", "scene", {}, kNow), ServiceError) << "keys are kept";
}

}  // namespace
}  // namespace rcs::service
