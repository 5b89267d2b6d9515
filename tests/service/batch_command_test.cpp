// rcsplat batch: frames that are complete, resumed and accounted for.

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <csignal>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/gltf_builder.h"
#include "support/rcsplat.h"
#include "support/small_render.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::bytes_of;
using test::expect_error;
using test::Outcome;
using test::rcsplat;
using test::TemporaryFolder;
using test::triangle_glb;
using test::write_bytes;

std::vector<std::string> small_batch(const std::string& scene, const std::string& frames, const std::string& output,
                                     const std::vector<std::string>& more = {})
{
    std::vector<std::string> words{"batch", scene,    "--frames", frames,  "--size", "24x24", "--aa",
                                   "1",     "--rays", "16",       "--fps", "10",     "-o",    output};
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

/// How many frames of the report are in a state.
int count(const TemporaryFolder& folder, const std::string& state)
{
    return json::parse(bytes_of(folder / "report.json")).at("counts").at(state);
}

/// A camera that moves over ten frames.
std::string walk(const std::string& more = "")
{
    return R"({"fps": 10, "keys": [{"frame": 1, "eye": [0.0, 0.5, 3.0], "target": [0, 0, 0]},
               {"frame": 10, "eye": [1.0, 0.5, 3.0], "target": [0, 0, 0]})" +
           more + "]}";
}

TEST(BatchCommand, IndependentFramesAreThoseOfRender)
{
    const TemporaryFolder folder;
    write_bytes(folder / "walk.json", walk());
    const std::vector<std::string> more{"--camera-path", folder / "walk.json", "--independent-frames", "-o",
                                        folder / "f.####.png"};
    const Outcome batch = rcsplat(small_batch("demo:furnace", "2-8x3", folder / "f.####.exr", more));
    EXPECT_EQ(batch.code, 0) << batch.err;
    for (const int frame : {2, 5, 8}) {
        const std::string digit = std::to_string(frame);
        EXPECT_EQ(rcsplat({"render", "demo:furnace", "--size", "24x24", "--aa", "1", "--rays", "16", "--camera-path",
                           folder / "walk.json", "--time", "0." + digit, "-o", folder / "one.exr", "-o",
                           folder / "one.png", "-q"})
                      .code,
                  0);
        EXPECT_EQ(bytes_of(folder / ("f.000" + digit + ".exr")), bytes_of(folder / "one.exr")) << frame;
        EXPECT_EQ(bytes_of(folder / ("f.000" + digit + ".png")), bytes_of(folder / "one.png")) << frame;
    }
}

/// Stands for ffmpeg: tells of its words and of what it is to show, and writes what the last word says.
void write_movie_maker(const TemporaryFolder& folder, const std::string& does)
{
    fs::create_directory(folder / "bin");
    write_bytes(folder / "bin/ffmpeg", "#!/bin/sh\n" + does);
    fs::permissions(folder / "bin/ffmpeg", fs::perms::owner_all);
}

Outcome batch_with_movie_maker(const TemporaryFolder& folder, const std::vector<std::string>& more = {})
{
    const std::string before = std::getenv("PATH");
    ::setenv("PATH", (folder / "bin:" + before).c_str(), 1);
    const Outcome batch = rcsplat(small_batch("demo:furnace", "2-8x3", folder / "f.####.png", more));
    ::setenv("PATH", before.c_str(), 1);
    return batch;
}

TEST(BatchCommand, MakesAMovieOfTheFrames)
{
    const TemporaryFolder folder;
    write_movie_maker(folder, "told='" + folder / "told" + "'\n" +
                                  R"sh(while [ $# -gt 1 ]; do
    case $1 in
        -framerate) echo "rate $2" >>"$told" ;;
        -i) for file in "$(dirname "$2")"/*.png; do readlink "$file" >>"$told"; done ;;
    esac
    shift
done
echo movie >"$1"
)sh");
    fs::create_directory(folder / ".preview.mp4.tmp-999999999");  // no process has that number: it was killed
    write_bytes(folder / ".preview.mp4.tmp-999999999/0.png", "a link");
    const Outcome none = batch_with_movie_maker(folder, {"--no-movie"});
    EXPECT_EQ(none.code, 0) << none.err;
    EXPECT_FALSE(fs::exists(folder / ".preview.mp4.tmp-999999999"));
    EXPECT_FALSE(fs::exists(folder / "told"));
    const Outcome batch = batch_with_movie_maker(folder);
    EXPECT_EQ(batch.code, 0) << batch.err;
    EXPECT_EQ(bytes_of(folder / "preview.mp4"), "movie\n");
    EXPECT_EQ(bytes_of(folder / "told"),
              "rate 10\n" + folder / "f.0002.png" + "\n" + folder / "f.0005.png" + "\n" + folder / "f.0008.png" + "\n");
    EXPECT_NE(bytes_of(folder / "report.html").find("href=\"preview.mp4\""), std::string::npos);
    EXPECT_EQ(json::parse(bytes_of(folder / "report.json")).at("movie"), "preview.mp4");
    batch_with_movie_maker(folder);
    EXPECT_EQ(bytes_of(folder / "told").find("rate", 1), std::string::npos) << "nothing has changed";
    EXPECT_EQ(json::parse(bytes_of(folder / "report.json")).at("movie"), "preview.mp4");
}

TEST(BatchCommand, SaysWhyThereIsNoMovie)
{
    const TemporaryFolder folder;
    write_movie_maker(folder, "echo first; echo no such encoder >&2; exit 1\n");
    const Outcome batch = batch_with_movie_maker(folder);
    EXPECT_EQ(batch.code, 0) << "the frames are there";
    EXPECT_NE(batch.err.find("preview.mp4 is not made: no such encoder"), std::string::npos) << batch.err;
    EXPECT_FALSE(fs::exists(folder / "preview.mp4"));
    for (const auto& entry : fs::directory_iterator(folder.path()))
        EXPECT_EQ(entry.path().filename().string().find(".tmp-"), std::string::npos) << entry.path();
    EXPECT_TRUE(json::parse(bytes_of(folder / "report.json")).at("movie").is_null());
}

TEST(BatchCommand, TakesARateAsAFraction)
{
    const TemporaryFolder folder;
    write_bytes(folder / "walk.json", walk());
    const auto frame = [&](const std::string& fps) {
        const Outcome batch =
            rcsplat({"batch", "demo:furnace", "--frames", "3", "--fps", fps, "--size", "24x24", "--aa", "1", "--rays",
                     "16", "--camera-path", folder / "walk.json", "-o", folder / "f.png"});
        EXPECT_EQ(batch.code, 0) << batch.err;
        return bytes_of(folder / "f.png");
    };
    EXPECT_EQ(frame("12.5"), frame("25/2"));
    EXPECT_EQ(count(folder, "kept"), 1) << "the very same time";
    frame("25/1");
    EXPECT_EQ(count(folder, "rendered"), 1) << "another time, another place";
}

TEST(BatchCommand, FramesOfAWalkThroughAStillSceneShareRecordsThatAreThereFromTheFirst)
{
    const TemporaryFolder folder;
    write_bytes(folder / "walk.json", walk());
    const auto words = small_batch("demo:cornell", "1-3", folder / "f.####.png",
                                   {"--camera-path", folder / "walk.json", "--log-level", "info", "--overwrite"});
    const Outcome batch = rcsplat(words);
    EXPECT_EQ(batch.code, 0) << batch.err;
    EXPECT_NE(batch.err.find("records placed beforehand, in 2 of the views of frames 1 to 3"), std::string::npos)
        << batch.err;
    const json report = json::parse(bytes_of(folder / "report.json"));
    const json frames = report.at("frames");
    double of_frames = 0.0;
    for (const json& frame : frames) {
        const json figures = frame.at("figures");
        of_frames += figures.at("seconds").get<double>();
        EXPECT_GT(figures.at("records_reused"), 10 * figures.at("records_made").get<int>());
        EXPECT_EQ(figures.at("exposure"), frames[0].at("figures").at("exposure")) << "or the film would flicker";
    }
    const auto ahead = report.at("ahead_seconds").get<double>();
    EXPECT_GT(ahead, 0.0);
    EXPECT_LT(ahead + of_frames, report.at("seconds")) << "which has both, and to start";
    EXPECT_NEAR(report.at("forecast_seconds"), ahead + of_frames, 1e-6) << "all frames anew take that again";
    // One that two processes died at comes last, and no other frame goes near it.
    write_bytes(folder / ".rcsplat/f.0001.png.json.running", "2\n");
    const Outcome wary = rcsplat(words);
    EXPECT_EQ(wary.code, 0) << wary.err;
    EXPECT_EQ(wary.err.find("placed beforehand"), std::string::npos) << wary.err;
    const json wary_report = json::parse(bytes_of(folder / "report.json")), again = wary_report.at("frames");
    EXPECT_EQ(wary_report.at("ahead_seconds"), 0.0);
    EXPECT_EQ(again[1].at("figures").at("records_reused"), 0);
    EXPECT_GT(again[0].at("figures").at("records_reused"), 0);
    // The second found the exposure of all; with the first there before it, it is done all the same.
    EXPECT_EQ(rcsplat(std::vector<std::string>(words.begin(), std::prev(words.end()))).code, 0);
    EXPECT_EQ(count(folder, "kept"), 3);
}

TEST(BatchCommand, RendersOnlyWhatIsMissingOrHasChanged)
{
    const TemporaryFolder folder;
    write_bytes(folder / "scene.glb", triangle_glb(0.0f));
    const auto batch = [&](const std::string& scene, const std::vector<std::string>& more = {}) {
        std::vector<std::string> words = small_batch(folder / scene, "1-3", folder / "f.####.png", {"--explain"});
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = rcsplat(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.out;
    };
    EXPECT_NE(batch("scene.glb").find("frame 3: rendered in "), std::string::npos);
    EXPECT_NE(batch("scene.glb").find("frame 3: done before"), std::string::npos);
    EXPECT_EQ(count(folder, "kept"), 3);

    fs::remove(folder / "f.0002.png");
    EXPECT_NE(batch("scene.glb").find("f.0002.png is missing"), std::string::npos);
    EXPECT_EQ(count(folder, "kept"), 2);

    fs::rename(folder / "scene.glb", folder / "renamed.glb");
    batch("renamed.glb");
    EXPECT_EQ(count(folder, "kept"), 3) << "a name is no light";

    EXPECT_NE(batch("renamed.glb", {"--bounces", "2"}).find("bounces was 1, is 2"), std::string::npos);
    EXPECT_EQ(count(folder, "rendered"), 3);
    batch("renamed.glb");

    std::string other = triangle_glb(0.0f);
    other.replace(other.find("\"triangle\""), 10, "\"Triangle\"");
    write_bytes(folder / "renamed.glb", other);
    batch("renamed.glb");
    EXPECT_EQ(count(folder, "kept"), 3) << "other bytes, the same light";
    write_bytes(folder / "renamed.glb", triangle_glb(0.5f));
    EXPECT_NE(batch("renamed.glb", {"--dry-run"}).find("frame 2: to be rendered: scene has changed"),
              std::string::npos);
    EXPECT_NE(batch("renamed.glb").find("scene has changed"), std::string::npos);
    EXPECT_EQ(count(folder, "rendered"), 3);
}

TEST(BatchCommand, AnimationCropAndLensAreSeenToChange)
{
    const TemporaryFolder folder;
    test::GltfBuilder b;
    const int triangle = b.add_triangle_mesh();
    b.add_node({{"mesh", triangle}});
    const int times = b.add_accessor(b.add_view(test::raw<float>({0, 1})), test::kFloat, "SCALAR", 2);
    b.root["accessors"][static_cast<std::size_t>(times)]["max"] = {1.0};
    for (const float height : {0.0f, 2.0f})
        b.add("animations",
              {{"name", height > 0.0f ? "fly" : "lie"},
               {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
               {"samplers", {{{"input", times}, {"output", b.add_vec3({{0, height, 0}, {1, height, 0}})}}}}});
    write_bytes(folder / "scene.glb", b.glb());
    const auto batch = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words = small_batch(folder / "scene.glb", "1-2", folder / "f.####.png");
        *(std::find(words.begin(), words.end(), "--aa") + 1) = "3";
        words.insert(words.end(), {"--eye", "0,0,9", "--target", "0,1,0"});
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = rcsplat(words);
        EXPECT_TRUE(outcome.code == 0 || outcome.code == 80) << outcome.err;  // the lens warns of so few samples
        return count(folder, "kept");
    };
    EXPECT_EQ(batch({}), 0);
    EXPECT_EQ(batch({"--animation", "all"}), 2) << "the default";
    EXPECT_EQ(batch({"--animation", "lie"}), 2) << "the second one moves what the first does: no other light";
    EXPECT_EQ(batch({"--animation", "fly"}), 0);
    EXPECT_EQ(batch({"--animation", "fly", "--crop", "3,4,12,10"}), 0);
    EXPECT_EQ(batch({"--animation", "fly", "--crop", "3,4,12,10"}), 2);
    EXPECT_EQ(batch({"--animation", "fly", "--crop", "4,4,12,10"}), 0);
    EXPECT_EQ(batch({"--animation", "fly", "--f-stop", "2", "--focus", "3"}), 0);
    EXPECT_EQ(batch({"--animation", "fly", "--f-stop", "2", "--focus", "3"}), 2);
    EXPECT_EQ(batch({"--animation", "fly", "--f-stop", "2", "--focus", "4"}), 0);
    expect_error({"render", folder / "scene.glb", "--time", "1", "--animation", "flie", "-o", folder / "a.png"},
                 test::kFailure, "has no animation 'flie'; it has lie, fly; did you mean", folder);
    EXPECT_NE(rcsplat({"plan", folder / "scene.glb"}).out.find("animation 1 fly of 1 s"), std::string::npos);
    const json plan = json::parse(rcsplat({"plan", folder / "scene.glb", "--json"}).out);
    EXPECT_EQ(plan.at("animations").at(0), (json{{"name", "lie"}, {"seconds", 1.0}}));
}

TEST(BatchCommand, RendersTheFramesThatSeeTheChange)
{
    const TemporaryFolder folder;
    const auto batch = [&](const std::string& more) {
        write_bytes(folder / "walk.json", walk(more));
        const Outcome outcome = rcsplat(
            small_batch("demo:furnace", "1-12", folder / "f.####.png", {"--camera-path", folder / "walk.json"}));
        EXPECT_EQ(outcome.code, 0) << outcome.err;
    };
    batch(R"(, {"frame": 11, "eye": [2, 0, 3], "target": [0, 0, 0], "cut": true})");
    EXPECT_EQ(count(folder, "rendered"), 12);
    batch(R"(, {"frame": 11, "eye": [3, 0, 3], "target": [0, 0, 0], "cut": true})");
    EXPECT_EQ(count(folder, "rendered"), 2);
    EXPECT_EQ(count(folder, "kept"), 10);
}

TEST(BatchCommand, AFrameThatFailsDoesNotStopTheOthers)
{
    const TemporaryFolder folder;
    write_bytes(folder / "walk.json", walk(R"(, {"frame": 11, "camera": "nowhere"},
        {"frame": 12, "eye": [2, 0, 3], "target": [0, 0, 0]})"));
    const Outcome outcome =
        rcsplat(small_batch("demo:furnace", "10-13", folder / "f.####.png", {"--camera-path", folder / "walk.json"}));
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.err.find("3 of 4 frames are there, 1 failed"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.out.find("frame 11: failed: "), std::string::npos) << outcome.out;
    EXPECT_NE(bytes_of(folder / "report.html").find("nowhere"), std::string::npos);
    const Outcome slow = rcsplat(small_batch("demo:furnace", "1", folder / "s.####.png", {"--time-limit", "1e-9"}));
    const json failed = json::parse(bytes_of(folder / "report.json")).at("frames")[0];
    EXPECT_NE(failed.at("log").get<std::string>().find("stage: "), std::string::npos) << failed;
    EXPECT_NE(bytes_of(folder / "report.html").find("<summary>log</summary>"), std::string::npos) << slow.out;
    EXPECT_TRUE(fs::exists(folder / "f.0012.png"));
    EXPECT_FALSE(fs::exists(folder / "f.0011.png"));
}

TEST(BatchCommand, GoesOnAfterBeingKilled)
{
    const TemporaryFolder folder, logs;
    const auto words = small_batch("demo:furnace", "1-40", folder / "f.####.png", {"-q", "--no-movie"});
    for (const char* frame : {"f.0002.png", "f.0009.png", "f.0020.png"}) {
        const pid_t pid = start(logs, words);
        while (!fs::exists(folder / frame)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        kill(pid, SIGKILL);
        EXPECT_EQ(finish(pid, logs).code, 128 + SIGKILL);
    }
    const std::string second = bytes_of(folder / ".rcsplat/f.0002.png.json");
    const Outcome last = rcsplat(words);
    EXPECT_EQ(last.code, 0) << last.err;
    EXPECT_EQ(count(folder, "rendered") + count(folder, "kept"), 40);
    EXPECT_GE(count(folder, "kept"), 19);
    EXPECT_EQ(bytes_of(folder / ".rcsplat/f.0002.png.json"), second) << "a finished frame is not rendered again";
    EXPECT_EQ(folder.names().size(), 40u + 3u) << "40 frames, the report and what is known of the frames";
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / ".rcsplat"), fs::directory_iterator()), 40);
}

TEST(BatchCommand, EndsInOrderWhenItIsTold)
{
    const TemporaryFolder folder, logs;
    const auto words = small_batch("demo:furnace", "1-2000", folder / "f.####.png");
    const pid_t pid = start(logs, words);
    while (!fs::exists(folder / "f.0003.png")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    kill(pid, SIGUSR1);
    while (!fs::exists(folder / "report.html")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_GE(count(folder, "rendered"), 2) << "the report so far";
    kill(pid, SIGTERM);
    kill(pid, SIGTERM);  // as schedulers do
    const Outcome outcome = finish(pid, logs);
    EXPECT_EQ(outcome.code, 128 + SIGTERM) << outcome.err;
    EXPECT_NE(outcome.err.find("the same command goes on"), std::string::npos) << outcome.err;
    const int done = count(folder, "rendered");
    EXPECT_EQ(count(folder, "left"), 2000 - done);
    EXPECT_EQ(folder.names().size(), static_cast<std::size_t>(done) + 3u);
    EXPECT_EQ(rcsplat(small_batch("demo:furnace", "1-" + std::to_string(done), folder / "f.####.png")).code, 0);
    EXPECT_EQ(count(folder, "kept"), done);
}

TEST(BatchCommand, TellsThatThereWereWarnings)
{
    const TemporaryFolder folder;
    write_bytes(folder / "empty.gltf", R"({"asset": {"version": "2.0"}})");
    for (const char* when : {"rendered", "done before"}) {
        const Outcome outcome = rcsplat(small_batch(folder / "empty.gltf", "1-2", folder / "f.####.png"));
        EXPECT_EQ(outcome.code, 80) << when;
        EXPECT_NE(outcome.err.find("rcsplat: warning: All 2 frames are there"), std::string::npos) << outcome.err;
        EXPECT_NE(bytes_of(folder / "report.html").find("nothing that can be drawn"), std::string::npos) << when;
    }
}

TEST(BatchCommand, LimitsTheTimeOfAFrame)
{
    const TemporaryFolder folder;
    const Outcome outcome = rcsplat({"batch", "demo:atrium", "--frames", "1", "--size", "600x400", "--time-limit",
                                     "0.01", "-o", folder / "f.####.png"});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.out.find("it took longer than --time-limit 0.01 s"), std::string::npos) << outcome.out;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / ".rcsplat"), fs::directory_iterator()), 0);
}

TEST(BatchCommand, RefusesWhatCannotBe)
{
    const TemporaryFolder folder;
    expect_error(small_batch("demo:furnace", "1-3", folder / "f.png"), test::kBadUsage, "needs a ####", folder);
    const auto rate = [&](const std::string& fps) {
        return std::vector<std::string>{"batch", "demo:furnace", "--frames", "1", "-o", folder / "f.png", "--fps", fps};
    };
    expect_error(rate("0"), test::kBadUsage, "--fps: fps is 0, expected a value in (0, 1000000]", folder);
    expect_error(rate("24/0"), test::kBadUsage, "fps is 0, expected a value in (0, 1000000000]", folder);
    expect_error(rate("24/"), test::kBadUsage, "fps is empty, expected", folder);
    expect_error(small_batch("demo:furnace", "3-1", folder / "f.####.png"), test::kBadUsage, "runs backwards", folder);
    expect_error(small_batch("demo:furnace", "1", folder / "f.####.bmp"), test::kBadUsage, "f.####.bmp", folder);
}

TEST(FlickerCommand, MeasuresFrames)
{
    const TemporaryFolder folder;
    ASSERT_EQ(rcsplat(small_batch("demo:cornell", "1-3", folder / "f.####.exr")).code, 0);
    const Outcome still =
        rcsplat({"flicker", folder / "f.0001.exr", folder / "f.0002.exr", folder / "f.0003.exr", "--json"});
    ASSERT_EQ(still.code, 0) << still.err;
    EXPECT_EQ(json::parse(still.out).at("points"), 24 * 24);
    EXPECT_EQ(json::parse(still.out).at("p95"), 0.0) << "nothing moves, and records are kept";
    ASSERT_EQ(rcsplat(small_batch("demo:cornell", "4", folder / "f.####.exr", {"--seed", "7"})).code, 0);
    const Outcome noisy = rcsplat({"flicker", folder / "f.0001.exr", folder / "f.0004.exr", "--json"});
    EXPECT_GT(json::parse(noisy.out).at("median"), 0.001) << "another seed for another frame";
}

}  // namespace
}  // namespace rcs
