#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/rcsplat.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using nlohmann::json;
using test::bytes_of;
using test::expect_error;
using test::Outcome;
using test::rcsplat;
using test::TemporaryFolder;
using test::write_bytes;

/// A camera that moves over ten frames.
std::string walk(const std::string& more)
{
    return R"({"fps": 10, "keys": [{"frame": 1, "eye": [0.0, 0.5, 3.0], "target": [0, 0, 0]},
               {"frame": 10, "eye": [1.0, 0.5, 3.0], "target": [0, 0, 0]})" +
           more + "]}";
}

TEST(ShutterOption, BlursFramesOfABatchAsOneOfRender)
{
    const TemporaryFolder folder;
    const std::vector<std::string> view{"--size", "24x24", "--aa",          "4",
                                        "--rays", "16",    "--camera-path", folder / "walk.json"};
    const auto batch = [&](const std::string& more, const std::vector<std::string>& options) {
        write_bytes(folder / "walk.json", walk(more));
        std::vector<std::string> words{
            "batch", "demo:furnace",       "--frames", "4-10x3", "--fps", "10", "--independent-frames",
            "-o",    folder / "f.####.exr"};
        words.insert(words.end(), view.begin(), view.end());
        words.insert(words.end(), options.begin(), options.end());
        const Outcome outcome = rcsplat(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return json::parse(bytes_of(folder / "report.json")).at("counts").at("kept").get<int>();
    };
    EXPECT_EQ(batch("", {}), 0);
    const std::string still = bytes_of(folder / "f.0007.exr");
    EXPECT_EQ(batch("", {"--shutter", "0"}), 3) << "the default";
    EXPECT_EQ(batch("", {"--shutter", "0.9"}), 0);
    EXPECT_EQ(batch("", {"--shutter", "0.9"}), 3);
    EXPECT_NE(bytes_of(folder / "f.0007.exr"), still);
    std::vector<std::string> words{"render", "demo:furnace", "--time",           "0.7", "--fps", "10", "--shutter",
                                   "0.9",    "-o",           folder / "one.exr", "-q"};
    words.insert(words.end(), view.begin(), view.end());
    EXPECT_EQ(rcsplat(words).code, 0);
    EXPECT_EQ(bytes_of(folder / "f.0007.exr"), bytes_of(folder / "one.exr"));
    EXPECT_EQ(batch(R"(, {"frame": 10.2, "eye": [0, 2, 3], "target": [0, 0, 0], "cut": true})", {"--shutter", "0.9"}),
              2)
        << "frame 10 sees the cut in its last moments";
}

TEST(ShutterOption, BlursAReferenceAsPicturesOfManyMoments)
{
    const TemporaryFolder folder;
    const auto picture = [&](const std::string& name, std::vector<std::string> words,
                             const std::vector<std::string>& more) {
        for (const char* word : {"demo:atrium", "--camera", "walk", "--size", "32x18", "--time", "1", "-q", "-o"})
            words.emplace_back(word);
        words.push_back(folder / name);
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = rcsplat(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
    };
    const std::vector<std::string> open{"--shutter", "0.9", "--fps", "4"};
    picture("truth.exr", {"reference", "--spp", "1024", "--aa", "64"}, open);
    picture("blurred.exr", {"render", "--aa", "64"}, open);
    picture("still.exr", {"reference", "--spp", "1024", "--aa", "64"}, {});
    const auto error = [&](const char* name) {
        const Outcome outcome =
            rcsplat({"compare", folder / name, folder / "truth.exr", "--layer", "direct", "--json"});
        return json::parse(outcome.out).at("mean_relative_error").get<double>();
    };
    EXPECT_LT(error("blurred.exr"), 0.1);
    EXPECT_GT(error("still.exr"), 3.0 * error("blurred.exr")) << "the blur does show";
}

TEST(ShutterOption, RefusesWhatCannotBe)
{
    const TemporaryFolder folder;
    const auto words = [&](const std::vector<std::string>& more) {
        std::vector<std::string> all{"render", "demo:furnace", "--size", "8x8", "-o", folder / "f.png"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    };
    expect_error(words({"--time", "1", "--shutter", "1.5"}), test::kBadUsage,
                 "shutter is 1.5, expected a value in [0, 1]", folder);
    expect_error(words({"--shutter", "0.5"}), test::kBadUsage, "--shutter requires --time", folder);
    expect_error(words({"--time", "1", "--fps", "24"}), test::kBadUsage, "--fps requires --shutter", folder);
    expect_error(words({"--time", "1", "--shutter", "0.5", "--aa", "1"}), test::kBadUsage,
                 "aa is 1, expected at least 2", folder);
    expect_error(words({"--time", "1", "--shutter", "0.5", "--records", folder / "r"}), test::kBadUsage,
                 "--records excludes --shutter", folder);
    expect_error({"submit", "demo:furnace", "--shutter", "0.5", "-o", folder / "f.png", "--server", folder / "none"},
                 test::kBadUsage, "--shutter needs --time or --frames", folder);
}

}  // namespace
}  // namespace rcs
