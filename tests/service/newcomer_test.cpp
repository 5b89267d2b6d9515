// Mistakes that new users make, as they are made: each ends with the code of its kind and one line that names what is
// wrong and what was probably meant.

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "process/exit_code.h"
#include "support/rcsplat.h"
#include "support/temporary_folder.h"

namespace rcs::service {
namespace {

using test::rcsplat;
using Words = std::vector<std::string>;

/// "@/" in words and names stands for a folder with the files below.
struct Mistake {
    const char* made;  ///< in words
    Words words;
    int code;
    Words names;  ///< what the line has to say
};

const Mistake kMistakes[] = {
    // Commands
    {"no command", {}, kBadUsage, {"a command is missing", "--help"}},
    {"a command mistyped",
     {"rendr", "demo:cornell"},
     kBadUsage,
     {"no command 'rendr'", "did you mean rcsplat render?"}},
    {"a command with a capital", {"Render", "demo:cornell"}, kBadUsage, {"did you mean rcsplat render?"}},
    {"no command before the scene", {"demo:cornell", "-o", "a.png"}, kBadUsage, {"rcsplat render demo:cornell"}},
    {"a file for a command", {"room.glb"}, kBadUsage, {"'room.glb' is no command", "rcsplat render room.glb"}},
    {"help as a command", {"help"}, kBadUsage, {"did you mean rcsplat --help?"}},
    {"version as a command", {"version"}, kBadUsage, {"did you mean rcsplat --version?"}},
    {"-v for the version", {"-v"}, kBadUsage, {"no option '-v'", "--version"}},
    {"an unknown command", {"frobnicate"}, kBadUsage, {"no command 'frobnicate'", "render, batch, view, plan"}},
    {"diff for compare", {"diff", "a.png", "b.png"}, kBadUsage, {"did you mean rcsplat compare?"}},
    // Options
    {"--resolution",
     {"render", "demo:cornell", "--resolution", "64x64"},
     kBadUsage,
     {"'--resolution'", "did you mean --size?"}},
    {"--sise", {"render", "demo:cornell", "--sise", "64x64"}, kBadUsage, {"'--sise'", "did you mean --size?"}},
    {"--width", {"render", "demo:cornell", "--width=64"}, kBadUsage, {"'--width'", "did you mean --size?"}},
    {"--samples", {"render", "demo:cornell", "--samples", "64"}, kBadUsage, {"did you mean --aa?"}},
    {"--out", {"render", "demo:cornell", "--out", "a.png"}, kBadUsage, {"did you mean --output?"}},
    {"--verbose", {"render", "demo:cornell", "--verbose"}, kBadUsage, {"did you mean --log-level?"}},
    {"--gpu", {"render", "demo:cornell", "--gpu"}, kBadUsage, {"did you mean --gather?"}},
    {"one dash", {"render", "demo:cornell", "-size", "64x64"}, kBadUsage, {"'-size'", "did you mean --size?"}},
    {"--stride of another command", {"render", "demo:cornell", "--stride", "4"}, kBadUsage, {"rcsplat reference has"}},
    {"an option like none", {"render", "demo:cornell", "--qqqq"}, kBadUsage, {"'--qqqq'", "--help-all"}},
    {"-o=a.png", {"render", "demo:cornell", "-o=a.png"}, kBadUsage, {"'-o=a.png'", "write -o a.png"}},
    {"a picture without -o", {"render", "demo:cornell", "a.png"}, kBadUsage, {"'a.png'", "-o a.png"}},
    {"two pictures after one -o",
     {"render", "demo:cornell", "-o", "a.png", "a.exr"},
     kBadUsage,
     {"'a.exr'", "-o a.exr"}},
    {"no value at the end", {"render", "demo:cornell", "--output"}, kBadUsage, {"--output needs a value: FILE"}},
    {"no output", {"render", "demo:cornell"}, kBadUsage, {"--output", "File to write"}},
    {"no scene", {"render", "-o", "a.png"}, kBadUsage, {"scene is missing", ".gltf or .glb", "demo:atrium"}},
    // Values
    {"one number for a size",
     {"render", "demo:cornell", "-o", "@/a.png", "--size", "64"},
     kBadUsage,
     {"--size", "640x360"}},
    {"a comma in a size",
     {"render", "demo:cornell", "-o", "@/a.png", "--size", "64,64"},
     kBadUsage,
     {"64,64", "WIDTHxHEIGHT"}},
    {"a size that is too large",
     {"render", "demo:cornell", "-o", "@/a.png", "--size", "99999x9"},
     kBadUsage,
     {"99999", "16384"}},
    {"5 for 5 %", {"render", "demo:cornell", "-o", "@/a.png", "--target-error", "5"}, kBadUsage, {"did you mean 5%?"}},
    {"an error of 0", {"render", "demo:cornell", "-o", "@/a.png", "--target-error", "0"}, kBadUsage, {"(0, 1]"}},
    {"seconds spelled out",
     {"render", "demo:cornell", "-o", "@/a.png", "--budget", "10sec"},
     kBadUsage,
     {"10sec", "may end in s or m"}},
    {"a word for a number",
     {"render", "demo:cornell", "-o", "@/a.png", "--bounces", "two"},
     kBadUsage,
     {"--bounces", "two", "[0, 64]"}},
    {"budget and target",
     {"render", "demo:cornell", "-o", "@/a.png", "--budget", "5s", "--target-error", "5%"},
     kBadUsage,
     {"--target-error, --budget"}},
    {"a layer mistyped",
     {"render", "demo:cornell", "-o", "@/a.exr", "--layers", "dept"},
     kBadUsage,
     {"no layer 'dept'", "did you mean 'depth'?"}},
    {"layers in a PNG",
     {"render", "demo:cornell", "-o", "@/a.png", "--layers", "depth"},
     kBadUsage,
     {"--layers", ".exr"}},
    {"an effect mistyped",
     {"render", "demo:cornell", "-o", "@/a.png", "--without", "glossy"},
     kBadUsage,
     {"glossy", "glossy-records"}},
    {"a log level mistyped",
     {"render", "demo:cornell", "-o", "@/a.png", "--log-level", "warn"},
     kBadUsage,
     {"warn", "did you mean 'warning'?"}},
    {"a splat method mistyped",
     {"render", "demo:cornell", "-o", "@/a.png", "--splat", "gpu"},
     kBadUsage,
     {"gpu", "quads"}},
    {"a priority in words", {"priority", "1", "high"}, kBadUsage, {"priority is high", "whole number in [-100, 100]"}},
    {"a job by its name",
     {"submit", "demo:cornell", "-o", "@/a.png", "--after", "yesterday"},
     kBadUsage,
     {"--after: yesterday is no number of a job"}},
    {"a job by its name, to be paused", {"pause", "mine"}, kBadUsage, {"mine is no number of a job"}},
    // Scenes and other files
    {"a scene mistyped",
     {"render", "demo:atrim", "-o", "@/a.png"},
     kNoInput,
     {"'demo:atrim'", "did you mean 'demo:atrium'?"}},
    {"demo: forgotten", {"render", "atrium", "-o", "@/a.png"}, kNoInput, {"'atrium'", "did you mean 'demo:atrium'?"}},
    {"a file mistyped",
     {"render", "@/rom.glb", "-o", "@/a.png"},
     kNoInput,
     {"rom.glb' does not exist", "did you mean 'room.glb'?"}},
    {"a mesh of another kind",
     {"render", "@/mesh.obj", "-o", "@/a.png"},
     kBadData,
     {"mesh.obj", "expected .gltf or .glb"}},
    {"a picture for a scene",
     {"render", "@/photo.jpg", "-o", "@/a.png"},
     kBadData,
     {"photo.jpg", "expected .gltf or .glb"}},
    {"text for a .glb", {"render", "@/room.glb", "-o", "@/a.png"}, kBadData, {"room.glb", "expected .gltf or .glb"}},
    {"a comma too many", {"render", "@/comma.gltf", "-o", "@/a.png"}, kBadData, {"comma.gltf", "line 2"}},
    {"a folder for a scene", {"render", "@/", "-o", "@/a.png"}, kBadData, {"is a folder"}},
    {"textures beside the folder",
     {"render", "@/scenes/up.gltf", "-o", "@/a.png"},
     kBadData,
     {"'../data.bin'", "--asset-root"}},
    {"an asset root that is none",
     {"render", "@/scenes/up.gltf", "--asset-root", "@/none", "-o", "@/a.png"},
     kNoInput,
     {"--asset-root", "none' does not exist"}},
    {"a camera mistyped",
     {"render", "demo:atrium", "--camera", "cort", "-o", "@/a.png"},
     kNoInput,
     {"'cort'", "did you mean 'court'?"}},
    {"a camera's number",
     {"render", "demo:atrium", "--camera", "9", "-o", "@/a.png"},
     kNoInput,
     {"'9'", "court, arcade"}},
    {"a missing sky",
     {"render", "demo:cornell", "--environment", "@/sky.hdr", "-o", "@/a.png"},
     kNoInput,
     {"sky.hdr' does not exist"}},
    {"an option twice",
     {"render", "demo:cornell", "--aa", "1", "--aa", "2", "-o", "@/a.png"},
     kBadUsage,
     {"--aa is given more than once"}},
    {"one frame alone", {"flicker", "@/a.exr"}, kBadUsage, {"frames needs at least 2 of them"}},
    {"no sky at all",
     {"render", "demo:cornell", "--environment", "blue", "-o", "@/a.png"},
     kBadUsage,
     {"--environment", "blue", "R,G,B"}},
    {"no ending", {"render", "demo:cornell", "-o", "@/a"}, kBadUsage, {"has no ending", ".exr, .png"}},
    {"an ending like none", {"render", "demo:cornell", "-o", "@/a.gif"}, kBadUsage, {"a.gif'", ".exr, .png"}},
    {"no such folder", {"render", "demo:cornell", "-o", "@/none/a.png"}, kCannotWrite, {"none' does not exist"}},
    {"no record file",
     {"render", "demo:cornell", "-o", "@/a.png", "--records", "@/mesh.obj", "--size", "8x8"},
     kBadData,
     {"mesh.obj", "no record file"}},
    {"pictures that are not there", {"compare", "@/a.exr", "@/b.exr"}, kNoInput, {"a.exr' does not exist"}},
    {"one picture to compare", {"compare", "@/a.exr"}, kBadUsage, {"reference is missing"}},
    // Other commands
    {"one frame for batch", {"batch", "demo:atrium", "-o", "@/a.png", "--frames", "1-3"}, kBadUsage, {"a.png", "####"}},
    {"frames backwards", {"batch", "demo:atrium", "-o", "@/a.##.png", "--frames", "3-1"}, kBadUsage, {"3-1"}},
    {"no frames", {"batch", "demo:atrium", "-o", "@/a.##.png"}, kBadUsage, {"--frames is missing"}},
    {"a job's name", {"fetch", "night"}, kBadUsage, {"night", "whole number >= 1"}},
    {"no job", {"watch"}, kBadUsage, {"job is missing"}},
    {"a report without folder", {"accuracy", "demo:cornell"}, kBadUsage, {"--output", "Folder"}},
    {"one point on a curve",
     {"accuracy", "demo:cornell", "-o", "@/r", "--points", "1"},
     kBadUsage,
     {"--points", "[2, 10]"}},
    {"a key that is none",
     {"serve", "--check", "--config", "@/key.conf"},
     kBadUsage,
     {"key.conf, line 2", "no option 'workrs'", "did you mean 'workers'?"}},
    {"a value that is none",
     {"serve", "--check", "--config", "@/value.conf"},
     kBadUsage,
     {"value.conf, line 3", "workers is many"}},
    {"a missing configuration",
     {"serve", "--check", "--config", "@/none.conf"},
     kNoInput,
     {"none.conf' does not exist"}},
    {"an option of serve mistyped", {"serve", "--worker", "2"}, kBadUsage, {"'--worker'", "did you mean --workers?"}},
};

void write_files(const test::TemporaryFolder& folder)
{
    test::write_bytes(folder / "room.glb", "a room\n");
    test::write_bytes(folder / "mesh.obj", "v 0 0 0\n");
    test::write_bytes(folder / "photo.jpg", "\xff\xd8\xff\xe0");
    test::write_bytes(folder / "comma.gltf", "{\"asset\":\n{\"version\":\"2.0\"},}");
    std::filesystem::create_directory(folder / "scenes");
    test::write_bytes(folder / "scenes/up.gltf",
                      R"({"asset":{"version":"2.0"},"buffers":[{"uri":"../data.bin","byteLength":36}],
                      "bufferViews":[{"buffer":0,"byteLength":36}],
                      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
                                    "min":[0,0,0],"max":[1,1,0]}],
                      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
                      "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0})");
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    test::write_bytes(folder / "data.bin", std::string(reinterpret_cast<const char*>(corners), sizeof corners));
    test::write_bytes(folder / "key.conf", "# how many\nworkrs = 2\n");
    test::write_bytes(folder / "value.conf", "# how many\n\n workers = many\n");
}

std::string in_folder(const test::TemporaryFolder& folder, std::string text)
{
    const std::size_t at = text.find("@/");
    if (at != text.npos) text.replace(at, 1, folder.path());
    return text;
}

class Newcomer : public testing::Test {
protected:
    void SetUp() override { write_files(folder_); }
    test::TemporaryFolder folder_;
};

TEST_F(Newcomer, IsToldInOneLineWhatWasWrong)
{
    ASSERT_GE(std::size(kMistakes), 60u);
    for (const Mistake& mistake : kMistakes) {
        SCOPED_TRACE(mistake.made);
        Words words;
        for (const std::string& word : mistake.words) words.push_back(in_folder(folder_, word));
        const test::Outcome outcome = rcsplat(words);
        EXPECT_EQ(outcome.code, mistake.code) << outcome.err;
        EXPECT_EQ(outcome.err.rfind("rcsplat: error: ", 0), 0u) << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
        EXPECT_EQ(outcome.out, "");
        for (const std::string& name : mistake.names)
            EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err << "does not name " << name;
    }
}

TEST_F(Newcomer, MayKeepTexturesBesideTheScenesFolder)
{
    const test::Outcome outcome = rcsplat({"render", folder_ / "scenes/up.gltf", "--asset-root", folder_.path(), "-o",
                                           folder_ / "up.png", "--size", "8x8", "--aa", "1", "-q"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder_ / "up.png"));
}

TEST_F(Newcomer, HearsOfASkyThatIsNoSky)
{
    const Words render = {"render", "demo:furnace", "--size", "8x8", "--aa", "1", "-q"};
    Words square = render;
    square.insert(square.end(), {"-o", folder_ / "square.png"});
    ASSERT_EQ(rcsplat(square).code, 0);
    Words lit = render;
    lit.insert(lit.end(), {"--environment", folder_ / "square.png", "-o", folder_ / "lit.png"});
    const test::Outcome outcome = rcsplat(lit);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.err.find("square.png' has 8 x 8 texels"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("twice as wide as high"), std::string::npos) << outcome.err;
}

TEST_F(Newcomer, HearsBeforeAndAfterThatABudgetIsNotEnough)
{
    const test::Outcome outcome = rcsplat({"render", "demo:cornell", "--size", "32x32", "--aa", "1", "--budget",
                                           "0.001s", "-o", folder_ / "a.png", "-q"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const std::size_t before = outcome.err.find("the budget of 0.001 s cannot be met");
    ASSERT_NE(before, std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("more than the budget of 0.001 s", before), std::string::npos) << outcome.err;
}

/// Help is read on a screen: it has no notes for the parser, no sentence that breaks off, and no line that is too long.
TEST_F(Newcomer, ReadsHelpThatIsForPeople)
{
    for (const char* command : {"render", "batch", "plan", "reference", "compare", "flicker", "accuracy", "serve",
                                "submit", "watch", "fetch", "cancel", "list", "stats", "doctor"})
        for (const char* help : {"--help", "--help-all"}) {
            SCOPED_TRACE(std::string(command) + " " + help);
            const test::Outcome outcome = rcsplat({command, help});
            EXPECT_EQ(outcome.code, 0);
            for (const char* note : {"Excludes:", "Needs:", "REQUIRED", "(Env:", ", or\n", "Positionals"})
                EXPECT_EQ(outcome.out.find(note), std::string::npos) << note << "\n" << outcome.out;
            for (std::size_t begin = 0; begin < outcome.out.size();) {
                const std::size_t end = std::min(outcome.out.find('\n', begin), outcome.out.size());
                EXPECT_LE(end - begin, 120u) << outcome.out.substr(begin, end - begin);
                begin = end + 1;
            }
        }
    const std::string little = rcsplat({"render", "--help"}).out, all = rcsplat({"render", "--help-all"}).out;
    EXPECT_LT(std::count(little.begin(), little.end(), '\n'), 60);
    EXPECT_EQ(little.find("--gradient-limit"), std::string::npos);
    EXPECT_NE(all.find("--gradient-limit"), std::string::npos);
    EXPECT_NE(little.find("rcsplat render --help-all"), std::string::npos);
    const std::string plan = rcsplat({"plan", "--help-all"}).out;
    for (const char* unused : {"--exposure", "--pixel-format", "--ocio", "--lobe-rays"})
        EXPECT_EQ(plan.find(unused), std::string::npos) << unused;
}

}  // namespace
}  // namespace rcs::service
