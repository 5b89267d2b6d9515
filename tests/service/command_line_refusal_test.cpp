// What rcsplat refuses, and in which words.

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/rcsplat.h"
#include "support/small_render.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using test::expect_error;
using test::kBadUsage;
using test::kFailure;
using test::rcsplat;
using test::small_render;
using test::TemporaryFolder;
using test::triangle_glb;
using test::write_bytes;

const std::vector<std::pair<std::string, std::string>> kBadValues{
    {"--environment", "sky"}, {"--environment", "1,2"},     {"--environment", "1,2,-3"}, {"--log-level", "all"},
    {"--pixel-format", "32"}, {"--environment", "1,2,3,4"}, {"--time", "soon"},          {"--time", "nan"},
};

struct BadNumber {
    const char *option, *value, *words;
};

// Options of the table are tried by option_table_test.cpp.
const BadNumber kBadNumbers[] = {
    {"--size", "0x0", "width is 0, expected a whole number in [1, 16384]"},
    {"--size", "64", "size is 64, expected WIDTHxHEIGHT"},
    {"--size", "64x", "height is empty, expected"},
    {"--size", "-4x4", "width is -4, expected"},
    {"--size", "64x64x64", "height is 64x64, expected"},
    {"--size", "16385x1", "width is 16385, expected"},
    {"--threads", "-1", "threads is -1, expected a whole number in [0, 1024]"},
    {"--exposure", "bright", "exposure is bright, expected auto or a value in [-64, 64]"},
    {"--exposure", "inf", "exposure is inf, expected a value in [-64, 64]"},
    {"--lens-shift", "1", "lens_shift is 1, expected RIGHT,UP, each a value in [-10, 10]"},
    {"--lens-shift", "0,11", "lens_shift is 11, expected a value in [-10, 10]"},
    {"--lens-shift", "nan,0", "lens_shift is nan,0, expected RIGHT,UP"},
    {"--eye", "1,2", "1,2 is not X,Y,Z, three finite numbers"},
    {"--fov", "180", "fov is 180, expected a value in (0, 179]"},
    {"--environment-rotation", "361", "environment_rotation is 361, expected a value in [-360, 360]"},
};

TEST(CommandLine, BadScenesFailWithOneLineThatNamesThem)
{
    const TemporaryFolder folder;
    const std::string picture = folder / "picture.png";
    write_bytes(folder / "whole.glb", triangle_glb(0.0f));
    ASSERT_EQ(rcsplat(small_render(folder / "whole.glb", {"-o", folder / "whole.png"})).code, 0)
        << "the triangle itself is fine";

    expect_error(small_render(folder / "missing.glb", {"-o", picture}), kFailure, "missing.glb", folder);
    for (const std::size_t length : {0u, 3u, 11u, 15u, 60u, 400u}) {
        write_bytes(folder / "truncated.glb", triangle_glb(0.0f).substr(0, length));
        expect_error(small_render(folder / "truncated.glb", {"-o", picture}), kFailure, "truncated.glb", folder);
    }
    const std::string whole = triangle_glb(0.0f);
    write_bytes(folder / "truncated.glb", whole.substr(0, whole.size() - 4));
    expect_error(small_render(folder / "truncated.glb", {"-o", picture}), kFailure, "truncated.glb", folder);

    for (const float z : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        write_bytes(folder / "nan.glb", triangle_glb(z));
        expect_error(small_render(folder / "nan.glb", {"-o", picture}), kFailure, "nan.glb", folder);
    }
    write_bytes(folder / "list.gltf", R"({"shopping": ["eggs", "milk"]})");
    expect_error(small_render(folder / "list.gltf", {"-o", picture}), kFailure, "list.gltf", folder);
    write_bytes(folder / "text.gltf", "not even JSON");
    expect_error(small_render(folder / "text.gltf", {"-o", picture}), kFailure, "text.gltf", folder);
    expect_error(small_render(folder.path(), {"-o", picture}), kFailure, folder.path(), folder);
    expect_error(small_render("demo:nope", {"-o", picture}), kFailure, "demo:nope", folder);
    expect_error(small_render("demo:cornell", {"-o", picture, "--camera", "nope"}), kFailure, "nope", folder);
    expect_error(small_render("demo:cornell", {"-o", picture, "--camera", "7"}), kFailure, "7", folder);
}

TEST(CommandLine, BadOutputsFailBeforeAnythingIsRendered)
{
    const TemporaryFolder folder;
    // So large that a test which renders first would run into its time limit.
    const auto huge = [](std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", "demo:cornell", "--size", "16384x16384", "--aa", "64"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    expect_error(huge({"-o", folder / "nowhere/a.png"}), kFailure, "nowhere", folder);
    expect_error(huge({"-o", "/proc/a.png"}), kFailure, "/proc/a.png", folder);
    expect_error(huge({"-o", folder / "a.png", "-o", folder / "nowhere/b.exr"}), kFailure, "b.exr", folder);
    std::filesystem::create_directory(folder / "dir.png");
    expect_error(huge({"-o", folder / "dir.png"}), kFailure, "dir.png", folder);
    expect_error(huge({"-o", folder / "a.gif"}), kBadUsage, "a.gif", folder);
    expect_error(huge({"-o", folder / "a.png", "-o", folder / "a.png"}), kBadUsage, "a.png", folder);
    expect_error(huge({"-o", folder / "a.png", "--stats", folder / "nowhere/s.json"}), kFailure, "s.json", folder);
    expect_error(huge({"-o", folder / "a.png", "--view", "Filmic"}), kFailure, "Filmic", folder);
    expect_error(huge({"-o", folder / "a.png", "--display", "Wall"}), kFailure, "Wall", folder);
    expect_error(huge({"-o", folder / "a.png", "--ocio", folder / "no.ocio"}), kFailure, "no.ocio", folder);
}

TEST(CommandLine, BadValuesNameTheOptionAndTheValue)
{
    const TemporaryFolder folder;
    for (const auto& [option, value] : kBadValues) {
        const std::vector<std::string> arguments{"render", "demo:cornell", "-o", folder / "a.exr", option, value};
        expect_error(arguments, kBadUsage, option + ": " + value + " ", folder);
    }
    for (const auto& [option, value, words] : kBadNumbers)
        expect_error({"render", "demo:cornell", "-o", folder / "a.exr", option, value}, kBadUsage,
                     std::string(option) + ": " + words, folder);
}

TEST(CommandLine, OptionsThatDoNotGoTogetherAreNamed)
{
    const TemporaryFolder folder;
    expect_error({"render", "demo:cornell"}, kBadUsage, "--output", folder);
    expect_error({"render", "-o", folder / "a.png"}, kBadUsage, "scene", folder);
    expect_error({"render", "demo:cornell", "-o", folder / "a.png", "--colour"}, kBadUsage, "--colour", folder);
    const std::string picture = folder / "a.png";
    const auto refuse = [&](const std::vector<std::string>& more, auto code, const std::string& words) {
        std::vector<std::string> all{"render", "demo:cornell", "-o", picture};
        all.insert(all.end(), more.begin(), more.end());
        expect_error(all, code, words, folder);
    };
    refuse({"--eye", "1,2,3"}, kBadUsage, "--eye requires --target");
    refuse({"--fov", "50"}, kBadUsage, "--fov requires --eye");
    refuse({"--eye", "1,2,3", "--target", "1,2,3"}, kBadUsage, "--target is the same place as eye");
    refuse({"--eye", "0,2,0", "--target", "0,1,0"}, kBadUsage, "--up runs along the way from eye to target");
    refuse({"--camera-path", "none.json"}, kFailure, "camera path 'none.json' cannot be opened");
    refuse({"--pixel-format", "half"}, kBadUsage, "half");
    expect_error({"render", "demo:cornell", "-o", picture, "--layers", "depth"}, kBadUsage, "--layers", folder);
    expect_error({"render", "demo:cornell", "-o", picture, "--budget", "5s", "--rays", "64"}, kBadUsage, "--rays",
                 folder);
    expect_error({"render", "demo:cornell", "-o", picture, "--target-error", "5%", "--noise", "0.1"}, kBadUsage,
                 "--noise", folder);
    expect_error({"render", "demo:cornell", "--dry-run", "--accuracy", "0.1"}, kBadUsage, "--accuracy", folder);
    expect_error({"render", "demo:cornell", "-o", folder / "a.png", "--effects", "mirrors"}, kBadUsage, "mirrors",
                 folder);
    for (const std::string gone : {"motion", "auto-exposure", "layer-depth"})
        expect_error({"render", "demo:cornell", "-o", folder / "a.png", "--without", gone}, kBadUsage,
                     "without_effects is " + gone + ", expected one of emission, ", folder);
    const std::vector<std::string> exr{"render", "demo:cornell", "-o", folder / "a.exr"};
    const auto more = [&](std::vector<std::string> words) {
        words.insert(words.begin(), exr.begin(), exr.end());
        return words;
    };
    expect_error(more({"--layers", "motion"}), kBadUsage, "needs --motion-time or --motion-camera", folder);
    expect_error(more({"--motion-time", "1"}), kBadUsage, "for --layers motion", folder);
    expect_error(more({"--layers", "motion", "--motion-time", "soon"}), kBadUsage, "--motion-time", folder);
    expect_error(more({"--layers", "motion", "--motion-time", "-1"}), kBadUsage, "is relative to --time", folder);
    expect_error({"plan", "demo:cornell", "--without", "all"}, kBadUsage, "--without", folder);
    expect_error({"paint", "demo:cornell"}, kBadUsage, "paint", folder);
    expect_error({}, kBadUsage, "a command is missing", folder);
    expect_error({"reference", "demo:cornell", "-o", folder / "a.exr", "--spp", "8"}, kBadUsage, "--spp", folder);
    expect_error({"reference", "demo:cornell", "-o", folder / "a.exr", "--stride", "0"}, kBadUsage, "--stride", folder);
    expect_error({"compare", folder / "a.exr", folder / "b.exr"}, kFailure, "a.exr", folder);
}

TEST(CommandLine, NumbersOfJobsAreCheckedBeforeAServerIsAsked)
{
    const TemporaryFolder folder;
    for (const char* command : {"watch", "fetch", "cancel"})
        for (const char* job : {"abc", "0", "1.5", "12x", "99999999999999999999"})
            expect_error({command, job, "--server", folder / "socket"}, kBadUsage, job, folder);
}

}  // namespace
}  // namespace rcs
