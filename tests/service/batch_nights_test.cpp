// Outputs of one night each, and what is removed of nights whose time is over.

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "batch/frame_record.h"
#include "batch/nights.h"
#include "process/clock.h"
#include "support/rcsplat.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;
using service::night_of;
using service::NightlyFiles;
using service::OldNight;
using service::remove_night;
using test::bytes_of;
using test::expect_error;
using test::Outcome;
using test::rcsplat;
using test::TemporaryFolder;
using test::write_bytes;

/// Noon of a day in 2026 in UTC, and hours later [ms].
std::int64_t hours_after_noon(int hours)
{
    return 1'764'000'000'000 / 86'400'000 * 86'400'000 + (12 + hours) * 3'600'000ll;
}

class Nights : public ::testing::Test {
protected:
    Nights()
    {
        ::setenv("TZ", "UTC", 1);
        ::tzset();
    }

    /// A frame that a batch of that night wrote, with one file.
    void make_frame(const std::string& night, int number)
    {
        const std::string file =
            service::at_night(folder_ / "p/{night}/f.000", night) + std::to_string(number) + ".png";
        fs::create_directories(fs::path(service::record_path(file)).parent_path());
        write_bytes(file, "picture");
        service::FrameRecord record;
        record.number = number;
        record.files = {{fs::path(file).filename().string(), 7, "", service::file_hash(file)}};
        service::write_frame_record(service::record_path(file), record);
    }
    NightlyFiles batch() const { return {{folder_ / "p/{night}/f.####.png"}, folder_ / "p/{night}"}; }
    bool is_there(const std::string& name) const
    {
        std::error_code ignored;
        return fs::exists(fs::symlink_status(folder_ / ("p/" + name), ignored));
    }

    TemporaryFolder folder_;
};

TEST_F(Nights, LastFromNoonToNoon)
{
    const std::string night = night_of(hours_after_noon(1));
    EXPECT_EQ(night_of(hours_after_noon(18)), night) << "six in the morning after";
    EXPECT_LT(night_of(hours_after_noon(-1)), night);
    EXPECT_GT(night_of(hours_after_noon(25)), night);
    EXPECT_EQ(service::at_night("a/{night}/b-{night}", night), "a/" + night + "/b-" + night);
}

TEST_F(Nights, AreFoundByTheirFoldersAndFiles)
{
    for (const char* name : {"2026-01-02", "2026-01-01", "2026-01-0", "2026-01-012", "x2026-01-03", "2026/01-04"})
        fs::create_directories(folder_ / ("p/" + std::string(name)));
    write_bytes(folder_ / "p/f-2026-02-01.0001.png", "");
    using Names = std::vector<std::string>;
    EXPECT_EQ(service::nights_of(folder_ / "p/{night}/f.####.png"), (Names{"2026-01-01", "2026-01-02"}));
    EXPECT_EQ(service::nights_of(folder_ / "p/x{night}/f.####.png"), Names{"2026-01-03"});
    EXPECT_EQ(service::nights_of(folder_ / "p/f-{night}.####.png"), Names{"2026-02-01"});
    EXPECT_EQ(service::nights_of(folder_ / "none/{night}.png"), Names{});
}

TEST_F(Nights, AreRemovedWithTheirFolders)
{
    make_frame("2026-01-01", 1);
    make_frame("2026-01-01", 2);
    make_frame("2026-01-02", 1);
    EXPECT_EQ(remove_night(batch(), "2026-01-01", false).files, 2u);
    EXPECT_TRUE(is_there("2026-01-01/f.0002.png")) << "it was only asked";
    const OldNight old = remove_night(batch(), "2026-01-01", true);
    EXPECT_EQ(old.files, 2u);
    EXPECT_EQ(old.bytes, 14u);
    EXPECT_TRUE(old.left.empty());
    EXPECT_FALSE(is_there("2026-01-01"));
    EXPECT_TRUE(is_there("2026-01-02/f.0001.png"));
    EXPECT_TRUE(is_there("")) << "what others may use";
}

TEST_F(Nights, NothingForeignIsRemoved)
{
    for (int number = 1; number <= 4; ++number) make_frame("2026-01-01", number);
    write_bytes(folder_ / "p/2026-01-01/f.0002.png", "pidture");  // of the same size
    write_bytes(folder_ / "p/2026-01-01/notes.txt", "mine");      // beside
    write_bytes(folder_ / "p/2026-01-01/f.0009.png", "picture");  // of no record
    fs::remove(folder_ / "p/2026-01-01/f.0003.png");
    write_bytes(folder_ / "elsewhere.png", "picture");
    fs::create_symlink(folder_ / "elsewhere.png", folder_ / "p/2026-01-01/f.0003.png");
    // Somebody writes that files elsewhere are a frame's.
    const std::string record = folder_ / "p/2026-01-01/.rcsplat/f.0004.png.json";
    auto told = *service::read_frame_record(record);
    told.files.push_back({"../../elsewhere.png", 7, "", service::file_hash(folder_ / "elsewhere.png")});
    told.files.push_back({folder_ / "elsewhere.png", 7, "", service::file_hash(folder_ / "elsewhere.png")});
    told.files.push_back({"f.0009.png", 7, "", service::file_hash(folder_ / "p/2026-01-01/f.0009.png")});
    service::write_frame_record(record, told);

    const OldNight old = remove_night(batch(), "2026-01-01", true);
    EXPECT_EQ(old.files, 2u) << "frames 1 and 4";
    EXPECT_EQ(old.left, (std::vector<std::string>{folder_ / "p/2026-01-01/f.0002.png"}));
    for (const char* name : {"f.0002.png", "f.0003.png", "f.0009.png", "notes.txt", ".rcsplat/f.0002.png.json"})
        EXPECT_TRUE(is_there(std::string("2026-01-01/") + name)) << name;
    EXPECT_TRUE(fs::exists(folder_ / "elsewhere.png"));
    EXPECT_FALSE(is_there("2026-01-01/f.0001.png"));
}

TEST_F(Nights, ALinkToAFolderIsNotFollowed)
{
    make_frame("2026-01-01", 1);
    fs::rename(folder_ / "p/2026-01-01", folder_ / "elsewhere");
    fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "p/2026-01-01");
    EXPECT_EQ(remove_night(batch(), "2026-01-01", true).files, 0u);
    EXPECT_TRUE(fs::exists(folder_ / "elsewhere/f.0001.png"));
}

TEST_F(Nights, OutputsWithoutANightAreEachNights)
{
    make_frame("2026-01-01", 1);
    NightlyFiles two = batch();
    two.outputs.push_back(folder_ / "p/last.png");
    write_bytes(folder_ / "p/last.png", "picture");
    const std::string record = folder_ / "p/2026-01-01/.rcsplat/f.0001.png.json";
    auto told = *service::read_frame_record(record);
    told.files.push_back({"../last.png", 7, "", service::file_hash(folder_ / "p/last.png")});
    service::write_frame_record(record, told);
    EXPECT_EQ(remove_night(two, "2026-01-01", true).files, 1u);
    EXPECT_TRUE(is_there("last.png"));
}

TEST_F(Nights, TheCommandKeepsTheLastOnes)
{
    const std::vector<std::string> batch{
        "batch",  "demo:furnace", "--frames", "1-2", "--size", "8x8",
        "--rays", "16",           "--aa",     "1",   "-o",     folder_ / "p/{night}/f.####.png"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), batch.begin(), batch.end());
        return rcsplat(more);
    };
    EXPECT_EQ(with({}).code, 0);
    const std::string today = service::nights_of(folder_ / "p/{night}/f.####.png").at(0);
    EXPECT_GE(today, night_of(service::read_clocks().wall_ms - 1000 * 3600));
    // It was made some nights ago.
    for (const char* night : {"2020-01-01", "2020-01-02"})
        fs::copy(folder_ / ("p/" + today), folder_ / ("p/" + std::string(night)), fs::copy_options::recursive);
    EXPECT_NE(with({"--keep-nights", "2", "--dry-run"}).out.find("the night 2020-01-01: 4 files"), std::string::npos);
    EXPECT_TRUE(is_there("2020-01-01/report.json"));
    const Outcome kept = with({"--keep-nights", "2"});
    EXPECT_EQ(kept.code, 0) << kept.err;
    EXPECT_NE(kept.out.find("the night 2020-01-01: 4 files of "), std::string::npos) << kept.out;
    EXPECT_FALSE(is_there("2020-01-01"));
    EXPECT_TRUE(is_there("2020-01-02/f.0001.png"));
    EXPECT_TRUE(is_there(today + "/f.0002.png"));
    const auto report = nlohmann::json::parse(bytes_of(folder_ / ("p/" + today + "/report.json")));
    EXPECT_EQ(report.at("removed").size(), 1u);

    EXPECT_EQ(with({"--keep-nights", "1", "--camera", "nobody", "--overwrite"}).code, 1);
    EXPECT_TRUE(is_there("2020-01-02/f.0001.png")) << "a night that is not whole takes no other's place";
    expect_error({"batch", "demo:furnace", "--frames", "1", "-o", folder_ / "p/f.png", "--keep-nights", "2"},
                 test::kBadUsage, "--keep-nights needs {night}", folder_);
}

}  // namespace
}  // namespace rcs
