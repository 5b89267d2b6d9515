// What a batch is made of: lists of frames, names of files, records of frames, flicker.

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/glm.hpp>

#include "batch/flicker.h"
#include "batch/frame_record.h"
#include "batch/frames.h"
#include "rcs/error.h"
#include "support/temporary_folder.h"

namespace rcs::service {
namespace {

using Frames = std::vector<int>;

TEST(Frames, AreListedInManyWays)
{
    EXPECT_EQ(parse_frames("7"), (Frames{7}));
    EXPECT_EQ(parse_frames("1-5"), (Frames{1, 2, 3, 4, 5}));
    EXPECT_EQ(parse_frames("1-10x3"), (Frames{1, 4, 7, 10}));
    EXPECT_EQ(parse_frames("1..10:4"), (Frames{1, 5, 9}));
    EXPECT_EQ(parse_frames("20,1-3,-2--1"), (Frames{-2, -1, 1, 2, 3, 20}));
    EXPECT_EQ(parse_frames("-4-4x4"), (Frames{-4, 0, 4}));
}

TEST(Frames, RefuseWhatIsNoList)
{
    for (const char* text : {"", "a", "1-", "-", "1,,2", "5-1", "1-5x0", "1-3,2", "1 - 3", "1-100000", "1x2", "1.5"})
        EXPECT_THROW(parse_frames(text), Error) << text;
}

TEST(Frames, HaveFilesOfTheirOwn)
{
    EXPECT_EQ(path_of_frame("a/beauty.####.exr", 12), "a/beauty.0012.exr");
    EXPECT_EQ(path_of_frame("a/beauty.%04d.exr", 12), "a/beauty.0012.exr");
    EXPECT_EQ(path_of_frame("b#.png", 12), "b12.png");
    EXPECT_EQ(path_of_frame("b%d.png", 12), "b12.png");
    EXPECT_EQ(path_of_frame("b.####.png", -3), "b.-0003.png");
    EXPECT_EQ(path_of_frame("shot#2/b.##.png", 7), "shot#2/b.07.png") << "the last place counts";
    EXPECT_FALSE(has_frame_pattern("beauty.exr"));
    EXPECT_FALSE(has_frame_pattern("100%.exr"));
    EXPECT_TRUE(has_frame_pattern("beauty.%03d.exr"));
}

TEST(FrameRecord, IsReadAsItWasWritten)
{
    const test::TemporaryFolder folder;
    FrameRecord record;
    record.number = -3;
    record.source = "abc";
    record.depends = {{"scene", "s"}, {"rays", "128"}};
    record.files = {{"a.exr", 17, "layers"}};
    record.figures.seconds = 1.5;
    record.figures.flicker = 0.25;
    record.figures.warnings = {"careful"};
    record.figures.thumbnail = "AAAA";
    write_frame_record(folder / "r.json", record);
    const auto read = read_frame_record(folder / "r.json");
    ASSERT_TRUE(read);
    EXPECT_EQ(read->number, -3);
    EXPECT_EQ(read->source, "abc");
    EXPECT_EQ(read->depends, record.depends);
    EXPECT_EQ(read->files, record.files);
    EXPECT_EQ(read->figures.seconds, 1.5);
    EXPECT_EQ(read->figures.flicker, 0.25);
    EXPECT_EQ(read->figures.warnings, record.figures.warnings);
    EXPECT_EQ(read->figures.thumbnail, "AAAA");
    for (const char* damaged : {"", "{", "[]", "{\"layout\": 1}", "{\"layout\": 99}"}) {
        test::write_bytes(folder / "bad.json", damaged);
        EXPECT_FALSE(read_frame_record(folder / "bad.json")) << damaged;
    }
}

TEST(FrameRecord, SaysWhatDiffers)
{
    const Dependencies was{{"scene", "1"}, {"rays", "128"}, {"view", "a"}};
    EXPECT_EQ(difference(was, was), "");
    EXPECT_EQ(difference(was, {{"scene", "2"}, {"rays", "64"}, {"view", "a"}}),
              "scene has changed, rays was 128, is 64");
    EXPECT_EQ(difference(was, {{"scene", "1"}, {"rays", "128"}}), "view was a");
    EXPECT_EQ(difference({}, {{"rays", "128"}}), "rays has changed");
}

TEST(FrameRecord, KnowsItsFiles)
{
    const test::TemporaryFolder folder;
    test::write_bytes(folder / "a.exr", "12345");
    FrameRecord record;
    record.files = {{"a.exr", 5, "half"}};
    const auto wrong = [&](const std::vector<FrameFile>& wanted) {
        return missing_file(record, wanted, folder.path());
    };
    EXPECT_EQ(wrong({{"a.exr", 0, "half"}}), "");
    EXPECT_EQ(wrong({{"a.exr", 0, "float"}}), "a.exr kept half, is to keep float");
    EXPECT_EQ(wrong({{"b.exr", 0, "half"}}), "b.exr was not asked for before");
    test::write_bytes(folder / "a.exr", "1234");
    EXPECT_EQ(wrong({{"a.exr", 0, "half"}}), "a.exr is not the file that was written");
    std::filesystem::remove(folder / "a.exr");
    EXPECT_EQ(wrong({{"a.exr", 0, "half"}}), "a.exr is missing");
}

/// A grey picture whose pixels are what `value` says.
FlickerFrame frame_of(int width, int height, const std::function<float(int, int)>& value)
{
    FlickerFrame frame{Image(width, height, 3), {}, {}, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) frame.light.at(x, y)[c] = value(x, y);
    return frame;
}

TEST(FlickerMeasure, IsTheTemporalStandardDeviation)
{
    // Two pixels: 1, 2, 3 has the standard deviation 1 and the mean 2, the other one is still; eps is 1 % of the last
    // frame's mean, (3 + 2) / 2.
    const auto frame = [](float left) { return frame_of(2, 1, [=](int x, int) { return x == 0 ? left : 2.0f; }); };
    const Flicker flicker = measure_flicker({frame(1.0f), frame(2.0f), frame(3.0f)});
    EXPECT_EQ(flicker.points, 2u);
    EXPECT_NEAR(flicker.all.mean, 0.5 * 1.0 / (2.0 + 0.025), 1e-6);
    EXPECT_NEAR(flicker.all.p95, 1.0 / (2.0 + 0.025), 1e-6);
    ASSERT_EQ(flicker.steps.size(), 2u);
    EXPECT_NEAR(flicker.steps[0].value(), 0.5 * 1.0 / (std::sqrt(2.0) * (1.5 + 0.02)), 1e-6);
}

TEST(FlickerMeasure, TellsSteadyChangeFromNoise)
{
    constexpr int kFrames = 24;
    const auto measure = [](float slope, float noise) {
        std::mt19937 random(7);
        std::normal_distribution<float> chance(0.0f, noise);
        std::vector<FlickerFrame> frames;
        for (int k = 0; k < kFrames; ++k) {
            FlickerFrame frame{Image(40, 40, 1), {}, {}, {}};
            for (float& pixel : frame.light.pixels) pixel = 10.0f + slope * static_cast<float>(k) + chance(random);
            frames.push_back(std::move(frame));
        }
        const Flicker flicker = measure_flicker(frames);
        return std::pair{flicker.all.mean, flicker.sudden->mean};
    };
    const auto expected = [](float slope) {
        const float mean = 10.0f + 0.5f * slope * (kFrames - 1), last = 10.0f + slope * (kFrames - 1);
        return static_cast<double>(0.1f / (mean + 0.01f * last));
    };
    const auto [still, same] = measure(0.0f, 0.1f);
    EXPECT_NEAR(still / expected(0.0f), 1.0, 0.04);
    EXPECT_NEAR(same / still, 1.0, 0.04) << "the same where frames have nothing in common";
    const auto [rising, sudden] = measure(0.05f, 0.1f);
    EXPECT_GT(rising, 0.03);
    EXPECT_NEAR(sudden / expected(0.05f), 1.0, 0.04);
    EXPECT_LT(measure(0.05f, 1e-6f).second, 1e-5);
    const auto grey = [](float value) { return frame_of(2, 2, [=](int, int) { return value; }); };
    EXPECT_FALSE(measure_flicker({grey(1.0f), grey(2.0f)}).sudden);
}

TEST(FlickerMeasure, FollowsWhatMoves)
{
    // A ramp that goes two pixels to the right and one up from frame to frame.
    const auto at = [](int step) {
        FlickerFrame frame = frame_of(16, 12, [=](int x, int y) { return 10.0f + (x - 2 * step) + 3.0f * (y + step); });
        frame.motion = Image(16, 12, 2);
        for (int y = 0; y < 12; ++y)
            for (int x = 0; x < 16; ++x) frame.motion->at(x, y)[0] = 2.0f, frame.motion->at(x, y)[1] = 1.0f;
        return frame;
    };
    std::vector<FlickerFrame> frames{at(0), at(1), at(2)};
    const Flicker followed = measure_flicker(frames);
    EXPECT_GT(followed.points, 60u);
    EXPECT_LT(followed.points, 16u * 12u) << "some come from outside";
    EXPECT_LT(followed.all.p95, 1e-6);
    for (FlickerFrame& frame : frames) frame.motion.reset();
    EXPECT_GT(measure_flicker(frames).all.median, 0.01);
}

TEST(FlickerMeasure, LeavesOutWhatWasHidden)
{
    const auto far = [](float depth, float light) {
        FlickerFrame frame = frame_of(4, 1, [=](int, int) { return light; });
        frame.motion = Image(4, 1, 2);
        frame.depth = Image(4, 1, 1);
        for (int x = 0; x < 4; ++x) *frame.depth->at(x, 0) = x == 0 ? depth : 5.0f;
        return frame;
    };
    EXPECT_EQ(measure_flicker({far(5.0f, 1.0f), far(5.1f, 1.0f)}).points, 4u);
    EXPECT_EQ(measure_flicker({far(5.0f, 1.0f), far(9.0f, 1.0f)}).points, 3u);
}

TEST(FlickerMeasure, LeavesOutWhatLiesBetweenThings)
{
    // Two halves, one of them far behind the other, that move by half a pixel: what shows at their border was in
    // between.
    const auto halves = [](float behind) {
        FlickerFrame frame = frame_of(8, 1, [](int x, int) { return x < 4 ? 1.0f : 3.0f; });
        frame.motion = Image(8, 1, 2);
        frame.depth = Image(8, 1, 1);
        for (int x = 0; x < 8; ++x) *frame.depth->at(x, 0) = x < 4 ? 5.0f : behind, frame.motion->at(x, 0)[0] = 0.5f;
        return frame;
    };
    EXPECT_EQ(measure_flicker({halves(5.1f), halves(5.1f)}).points, 7u) << "the first one comes from outside";
    const Flicker apart = measure_flicker({halves(9.0f), halves(9.0f)});
    EXPECT_EQ(apart.points, 6u);
    EXPECT_EQ(apart.all.p95, 0.0);
}

TEST(FlickerMeasure, LeavesOutWhatLiesBetweenSurfacesThatFaceOtherWays)
{
    // Two walls that meet, each under light of its own, move by half a pixel between frames.
    const auto walls = [](float degrees) {
        std::vector<FlickerFrame> frames;
        for (int frame = 0; frame < 2; ++frame) {
            FlickerFrame shown = frame_of(8, 1, [](int x, int) { return x < 4 ? 1.0f : 3.0f; });
            shown.motion = Image(8, 1, 2);
            shown.normal = Image(8, 1, 3);
            for (int x = 0; x < 8; ++x) {
                const float turned = x < 4 ? 0.0f : glm::radians(degrees);
                shown.motion->at(x, 0)[0] = 0.5f;
                shown.normal->at(x, 0)[0] = std::sin(turned), shown.normal->at(x, 0)[2] = std::cos(turned);
            }
            frames.push_back(std::move(shown));
        }
        return measure_flicker(frames);
    };
    EXPECT_EQ(walls(5.0f).points, 7u) << "a surface that bends a little";
    EXPECT_GT(walls(5.0f).all.p95, 0.1);
    EXPECT_EQ(walls(60.0f).points, 6u);
    EXPECT_EQ(walls(60.0f).all.p95, 0.0);
    EXPECT_TRUE(walls(60.0f).steps.at(0));
}

TEST(FlickerMeasure, SaysWhereNothingCanBeFollowed)
{
    FlickerFrame gone = frame_of(4, 1, [](int, int) { return 1.0f; });
    gone.motion = Image(4, 1, 2);
    for (int x = 0; x < 4; ++x) gone.motion->at(x, 0)[0] = 9.0f;
    EXPECT_FALSE(change_between(gone, gone));
    const Flicker flicker = measure_flicker({gone, gone});
    EXPECT_EQ(flicker.points, 0u);
    EXPECT_FALSE(flicker.steps.at(0));
}

}  // namespace
}  // namespace rcs::service
