// Runs the real rcsplat, as a user does.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rcs/effects.h"
#include "rcs/image_io.h"
#include "support/rcsplat.h"
#include "support/small_render.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using test::bytes_of;
using test::expect_error;
using test::finish;
using test::kBadUsage;
using test::kFailure;
using test::Outcome;
using test::rcsplat;
using test::small_render;
using test::start;
using test::TemporaryFolder;
using test::triangle_glb;
using test::write_bytes;

TEST(CommandLine, RendersACornellBoxToEveryFormatWithStatistics)
{
    const TemporaryFolder folder;
    const Outcome outcome =
        rcsplat({"render", "demo:cornell", "--size", "64x48", "--rays", "64", "-o", folder / "a.exr", "-o",
                 folder / "a.png", "-o", folder / "a.jpg", "--stats", folder / "a.json", "--seed", "3"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("records"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("a.png"), std::string::npos) << outcome.out;
    std::vector<std::string> names = folder.names();
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"a.exr", "a.jpg", "a.json", "a.png"}));
    EXPECT_EQ(bytes_of(folder / "a.png").substr(1, 3), "PNG");

    const auto stats = nlohmann::json::parse(bytes_of(folder / "a.json"));
    EXPECT_EQ(stats.at("scene"), "demo:cornell");
    EXPECT_EQ(stats.at("width"), 64);
    EXPECT_EQ(stats.at("height"), 48);
    EXPECT_EQ(stats.at("options").at("seed"), "3");
    EXPECT_GT(stats.at("records").get<int>(), 0);
    EXPECT_GE(stats.at("rays").at("hemisphere").get<int>(), 16 * stats.at("records").get<int>());
    EXPECT_GT(stats.at("splats").get<int>(), 0);
    EXPECT_GT(stats.at("pixels_per_splat").get<double>(), 0.0);
    EXPECT_GE(stats.at("threads").get<int>(), 1);
    EXPECT_NE(stats.at("gl").at("renderer"), "");
    EXPECT_GT(stats.at("peak_memory_bytes").get<double>(), 1e6);
    EXPECT_EQ(stats.at("images").size(), 3u);
    double sum = 0.0;
    for (const char* stage : {"load", "bvh", "gbuffer", "direct", "records", "splat", "compose", "tone map", "write"}) {
        EXPECT_TRUE(stats.at("stage_seconds").contains(stage)) << stage;
    }
    for (const auto& stage : stats.at("stages")) sum += stage.at("seconds").get<double>();
    EXPECT_LE(sum, stats.at("seconds").get<double>());
    EXPECT_GT(sum, 0.8 * stats.at("seconds").get<double>()) << "the stages account for the time";
}

TEST(CommandLine, PrintsTheSameStatisticsAsJson)
{
    const TemporaryFolder folder;
    const Outcome outcome = rcsplat(small_render("demo:cornell", {"--json", "-o", folder / "a.png"}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("command"), "render");
    const Outcome quiet = rcsplat(small_render("demo:cornell", {"--quiet", "-o", folder / "a.png"}));
    EXPECT_EQ(quiet.code, 0);
    EXPECT_EQ(quiet.out + quiet.err, "");
}

TEST(CommandLine, GivesTheSameFilesForAnyNumberOfThreads)
{
    const TemporaryFolder folder;
    for (const std::string threads : {"1", "2", "3"}) {
        const Outcome outcome =
            rcsplat({"render", "demo:cornell", "--size", "64x64", "--rays", "64", "--aa", "2", "--threads", threads,
                     "-o", folder / (threads + ".exr"), "-o", folder / (threads + ".png")});
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
    for (const std::string threads : {"2", "3"}) {
        EXPECT_EQ(bytes_of(folder / "1.exr"), bytes_of(folder / (threads + ".exr")));
        EXPECT_EQ(bytes_of(folder / "1.png"), bytes_of(folder / (threads + ".png")));
    }
    const Outcome outcome = rcsplat({"compare", folder / "1.exr", folder / "2.exr", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto metrics = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(metrics.at("rmse"), 0.0);
    EXPECT_EQ(metrics.at("relmse"), 0.0);
    EXPECT_EQ(metrics.at("pixels"), 64 * 64);
}

TEST(CommandLine, ReferenceWithAStrideIsComparedAtItsOwnPixels)
{
    const TemporaryFolder folder;
    const Outcome reference = rcsplat({"reference", "demo:cornell", "--size", "64x64", "--spp", "64", "--stride", "4",
                                       "-o", folder / "r.exr", "-o", folder / "r.png"});
    ASSERT_EQ(reference.code, 0) << reference.err;
    ASSERT_EQ(rcsplat({"render", "demo:cornell", "--size", "64x64", "--aa", "1", "-o", folder / "a.exr"}).code, 0);
    const Outcome outcome = rcsplat({"compare", folder / "a.exr", folder / "r.exr", "--layer", "albedo", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto metrics = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(metrics.at("pixels"), 16 * 16);
    // Both see the same surface at pixel centres; the picture is stored as half (11 bits), the reference as float.
    EXPECT_LE(metrics.at("median_relative_error").get<double>(), 0x1p-11);

    const Outcome table = rcsplat({"compare", folder / "a.exr", folder / "r.exr"});
    EXPECT_NE(table.out.find("relMSE"), std::string::npos) << table.out;
    EXPECT_NE(table.out.find("FLIP            not defined"), std::string::npos) << table.out;
    EXPECT_TRUE(metrics.at("flip").is_null());
    const Outcome same = rcsplat({"compare", folder / "a.exr", folder / "a.exr"});
    EXPECT_NE(same.out.find("FLIP            0.0000"), std::string::npos) << same.out;
}

TEST(CommandLine, EnvironmentLightsAnEmptyView)
{
    const TemporaryFolder folder;
    write_bytes(folder / "t.glb", triangle_glb(0.0f));
    const Outcome outcome = rcsplat({"render", folder / "t.glb", "--size", "32x32", "--environment", "0.5,0.25,0.125",
                                     "--exposure", "0", "--view", "Un-tone-mapped", "-o", folder / "a.png", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto shown = nlohmann::json::parse(outcome.out).at("tone_map");
    EXPECT_EQ(shown.at("view"), "Un-tone-mapped");
    EXPECT_EQ(shown.at("exposure"), 0.0);
}

TEST(CommandLine, SaysWhatItGivesToAFileWithoutLight)
{
    const TemporaryFolder folder;
    write_bytes(folder / "t.glb", triangle_glb(0.0f));
    const Outcome outcome =
        rcsplat(small_render(folder / "t.glb", {"-o", folder / "a.png", "--log-level", "info", "--time", "1.5"}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("t.glb: has no light; a neutral sky of radiance 1"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("t.glb: has no animation"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("no camera"), std::string::npos) << outcome.err;
}

TEST(CommandLine, ACameraOfItsOwnSeesWhatTheScenesDoes)
{
    const TemporaryFolder folder;
    write_bytes(folder / "walk.json", R"({"fps": 10, "keys": [
        {"frame": 0, "eye": [0.0, 9.0, 3.0], "target": [0, 0, 0]},
        {"frame": 10, "eye": [0.0, 0.5, 3.0], "target": [0, 0, 0], "fov": 45}]})");
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.end(), {"-o", folder / name, "-q"});
        EXPECT_EQ(rcsplat(small_render("demo:furnace", more)).code, 0) << name;
        return bytes_of(folder / name);
    };
    const std::string own = render("own.png", {"--camera", "front"});
    EXPECT_EQ(render("placed.png", {"--eye", "0,0.5,3", "--target", "0,0,0", "--fov", "45"}), own);
    EXPECT_EQ(render("path.png", {"--camera-path", folder / "walk.json", "--time", "1"}), own);
    EXPECT_NE(render("above.png", {"--camera-path", folder / "walk.json"}), own);
}

TEST(CommandLine, RecordsAreKeptFromRenderToRender)
{
    const TemporaryFolder folder;
    const std::string file = folder / "room.records";
    const auto stats_of = [&](const std::vector<std::string>& more, const std::string& picture) {
        std::vector<std::string> arguments{"--records", file, "--json", "-o", picture};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = rcsplat(small_render("demo:atrium", arguments));
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return nlohmann::json::parse(outcome.out);
    };
    const auto first = stats_of({}, folder / "a.png");
    EXPECT_EQ(first.at("record_file").at("loaded"), 0);
    EXPECT_EQ(first.at("record_file").at("saved"), first.at("records"));
    const std::string saved = bytes_of(file);
    const auto again = stats_of({}, folder / "b.png");
    EXPECT_EQ(again.at("records"), 0);
    EXPECT_EQ(again.at("rays").at("hemisphere"), 0);
    EXPECT_EQ(again.at("record_file").at("loaded"), first.at("records"));
    EXPECT_EQ(bytes_of(folder / "a.png"), bytes_of(folder / "b.png"));
    EXPECT_EQ(bytes_of(file), saved) << "nothing was added";

    // Another view adds what it sees beyond.
    const auto beside = stats_of({"--lens-shift", "0.5,0"}, folder / "c.png");
    EXPECT_GT(beside.at("records"), 0);
    EXPECT_LT(beside.at("records"), first.at("records"));
    EXPECT_EQ(beside.at("record_file").at("saved").get<int>(),
              first.at("records").get<int>() + beside.at("records").get<int>());
    const std::string grown = bytes_of(file);

    const std::string picture = folder / "d.png";
    expect_error(small_render("demo:cornell", {"--records", file, "-o", picture}), kFailure, "room.records", folder);
    expect_error(small_render("demo:atrium", {"--records", file, "-o", picture, "--bounces", "2"}), kFailure,
                 "bounces 1", folder);
    expect_error(small_render("demo:atrium", {"--records", folder / "nowhere/a", "-o", picture}), kFailure, "nowhere",
                 folder);
    for (const auto& [option, value] : {std::pair{"--budget", "5s"}, {"--target-error", "5%"}})
        expect_error(small_render("demo:atrium", {"--records", file, "-o", picture, option, value}), kBadUsage, option,
                     folder);
    expect_error({"render", "demo:atrium", "--records", file, "--dry-run"}, kBadUsage, "--dry-run", folder);
    for (const std::string& same : {picture, folder.path() + "/./d.png"})
        expect_error(small_render("demo:atrium", {"--records", same, "-o", picture}), kBadUsage,
                     "is the same file as that of --output", folder);
    expect_error(small_render("demo:atrium", {"--records", file, "-o", picture, "--stats", file}), kBadUsage,
                 "is the same file as that of --stats", folder);
    std::filesystem::create_symlink(folder / "nowhere/b", folder / "dangling");
    expect_error(small_render("demo:atrium", {"--records", folder / "dangling", "-o", picture}), kFailure, "dangling",
                 folder);
    expect_error(small_render("demo:atrium", {"--records", file, "-o", picture, "--server", "s"}), kBadUsage,
                 "--records", folder);
    EXPECT_EQ(bytes_of(file), grown);
    write_bytes(file, grown.substr(0, grown.size() / 2));
    expect_error(small_render("demo:atrium", {"--records", file, "-o", picture}), kFailure, "room.records", folder);
    EXPECT_EQ(bytes_of(file).size(), grown.size() / 2) << "what is damaged is left for its owner to look at";
}

TEST(CommandLine, HelpOfEveryCommandHasAnExampleAndTheDefaults)
{
    for (const std::string command : {"render", "plan", "reference", "compare", "accuracy"}) {
        const Outcome help = rcsplat({command, "--help"});
        EXPECT_EQ(help.code, 0);
        EXPECT_NE(help.out.find("Example: rcsplat " + command), std::string::npos) << help.out;
    }
    EXPECT_NE(rcsplat({"render", "--help"}).out.find("1000x1000"), std::string::npos);
    const Outcome version = rcsplat({"--version"});
    EXPECT_EQ(version.code, 0);
    EXPECT_EQ(version.out.rfind("rcsplat ", 0), 0u) << version.out;
}

TEST(CommandLine, PlanSaysWhatARenderWouldDoAndWhy)
{
    const TemporaryFolder folder;
    const Outcome text = rcsplat({"plan", "demo:cornell", "--size", "48x48", "-o", folder / "a.png"});
    ASSERT_EQ(text.code, 0) << text.err;
    EXPECT_NE(text.out.find("on   area-light             2 triangles shine\n"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("off  punctual-light         no lamp without size shines\n"), std::string::npos)
        << text.out;
    EXPECT_NE(text.out.find("off  layer normal           no output keeps it\n"), std::string::npos) << text.out;
    EXPECT_TRUE(folder.names().empty()) << "nothing is written";

    const Outcome json =
        rcsplat({"plan", "demo:cornell", "--size", "48x48", "--bounces", "3", "--without", "more-bounces", "--json"});
    ASSERT_EQ(json.code, 0) << json.err;
    const auto plan = nlohmann::json::parse(json.out).at("plan");
    EXPECT_EQ(plan.at("bounces"), 1);
    bool found = false;
    for (const auto& effect : plan.at("effects")) {
        if (effect.at("name") != "more-bounces") continue;
        found = true;
        EXPECT_EQ(effect.at("needed"), false);
        EXPECT_EQ(effect.at("chosen_by_user"), true);
        EXPECT_NE(effect.at("reason").get<std::string>().find("left out on demand"), std::string::npos);
    }
    EXPECT_TRUE(found);
}

TEST(CommandLine, ARenderKeepsItsPlanAndSaysWhatItLeavesOut)
{
    const TemporaryFolder folder;
    const Outcome outcome = rcsplat(small_render("demo:spheres", {"-o", folder / "a.exr", "--stats", folder / "a.json",
                                                                  "--log-level", "info", "--without", "traced-lobes"}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("left out: traced-lobes: left out on demand"), std::string::npos) << outcome.err;
    const auto stats = nlohmann::json::parse(bytes_of(folder / "a.json"));
    EXPECT_EQ(stats.at("rays").at("lobe"), 0);
    EXPECT_EQ(stats.at("counts").at("passes").at("lobes"), 0);
    EXPECT_GT(stats.at("counts").at("passes").at("splat_glossy"), 0);
    EXPECT_EQ(stats.at("plan").at("effects").size(), rcs::kEffects);
    const rcs::LayeredImage image = rcs::read_image(folder / "a.exr");
    EXPECT_NE(image.metadata.at("rcs:effects").find("glossy-records"), std::string::npos);
    EXPECT_EQ(image.metadata.at("rcs:effects").find("traced-lobes"), std::string::npos);
    EXPECT_NE(image.metadata.at("rcs:effects-left-out").find("traced-lobes: left out on demand"), std::string::npos);
}

TEST(CommandLine, ADryRunPrintsAForecastOrThatThereIsNone)
{
    const Outcome lit = rcsplat({"render", "demo:cornell", "--size", "48x48", "--aa", "1", "--dry-run"});
    EXPECT_EQ(lit.code, 0) << lit.err;
    EXPECT_NE(lit.out.find(" s"), std::string::npos) << lit.out;
    const Outcome dark = rcsplat({"render", "demo:cornell", "--size", "48x48", "--bounces", "0", "--dry-run"});
    EXPECT_EQ(dark.code, 0) << dark.err;
    EXPECT_EQ(dark.out, "there is no indirect light to forecast the error of\n");
}

TEST(CommandLine, OnlyReadingPicturesTakesTheModuleThatReadsThem)
{
    const TemporaryFolder folder;
    for (const auto& entry : std::filesystem::directory_iterator(RCS_BIN_DIR "/../lib"))
        if (entry.path().filename().string().starts_with("librcs.so"))
            std::filesystem::copy(entry.path(), folder / entry.path().filename().string(),
                                  std::filesystem::copy_options::copy_symlinks);
    const char* const before = getenv("LD_LIBRARY_PATH");
    const std::string restored = before ? before : "";
    setenv("LD_LIBRARY_PATH", folder.path().c_str(), 1);
    for (const std::string ending : {"png", "jpg", "exr"}) {
        const Outcome written = rcsplat(small_render("demo:cornell", {"-o", folder / ("a." + ending)}));
        EXPECT_EQ(written.code, 0) << written.err;
    }
    const Outcome read = rcsplat({"compare", folder / "a.exr", folder / "a.exr"});
    EXPECT_EQ(read.code, kFailure);
    EXPECT_NE(read.err.find("cannot read image files: "), std::string::npos) << read.err;
    EXPECT_NE(read.err.find("/images-"), std::string::npos) << read.err;
    setenv("LD_LIBRARY_PATH", restored.c_str(), 1);
    EXPECT_EQ(rcsplat({"compare", folder / "a.exr", folder / "a.exr"}).code, 0);
}

TEST(CommandLine, AnInterruptEndsItWithoutLeavingFiles)
{
    const TemporaryFolder folder;
    const TemporaryFolder logs;
    const pid_t pid =
        start(logs, {"reference", "demo:cornell", "--size", "1000x1000", "--spp", "65536", "-o", folder / "a.exr"});
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    kill(pid, SIGINT);
    const auto asked = std::chrono::steady_clock::now();
    // The library listens about once per cent of the work, which here is long: a second signal is deadly.
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    kill(pid, SIGINT);
    const Outcome outcome = finish(pid, logs);
    EXPECT_EQ(outcome.code, 130);
    EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(20));
    EXPECT_TRUE(folder.names().empty());
}

TEST(CommandLine, OneInterruptIsEnoughForAnOrderlyEnd)
{
    const TemporaryFolder folder;
    const TemporaryFolder logs;
    const pid_t pid = start(
        logs, {"render", "demo:cornell", "--size", "512x512", "--aa", "64", "--rays", "4096", "-o", folder / "a.png"});
    std::this_thread::sleep_for(std::chrono::seconds(2));  // long enough to start, far from the end
    kill(pid, SIGINT);
    const Outcome outcome = finish(pid, logs);
    EXPECT_EQ(outcome.code, 130);
    EXPECT_NE(outcome.err.find("rcsplat: error: "), std::string::npos) << outcome.err;
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace rcs
