// `rcsplat accuracy`, from the command line to its files.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/rcsplat.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using test::bytes_of;
using test::expect_error;
using test::kBadUsage;
using test::kFailure;
using test::Outcome;
using test::rcsplat;
using test::TemporaryFolder;

std::vector<std::string> small_accuracy(const std::string& folder, const std::vector<std::string>& more = {})
{
    std::vector<std::string> arguments{
        "accuracy", "demo:cornell",      "--size", "24x24", "--points", "0.5:16:0.4,0.2:64:0.1", "--path-samples",
        "16,32",    "--reference-error", "8",      "-o",    folder};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

TEST(AccuracyCommand, WritesPagePictureAndTableAndTakesUpWhatItKept)
{
    const TemporaryFolder folder;
    const std::string report = folder / "new/report";
    const Outcome first = rcsplat(small_accuracy(report, {"--stats", folder / "s.json"}));
    ASSERT_EQ(first.code, 0) << first.err;
    EXPECT_NE(first.out.find(" costs "), std::string::npos) << first.out;
    EXPECT_NE(first.out.find("--accuracy 0.2 --rays 64 --noise 0.1"), std::string::npos) << first.out;
    EXPECT_EQ(bytes_of(report + "/curve.png").substr(1, 3), "PNG");
    const std::string csv = bytes_of(report + "/curve.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5) << csv;
    const std::string page = bytes_of(report + "/index.html");
    EXPECT_EQ(page.rfind("<!doctype html>", 0), 0u);
    EXPECT_EQ(page.find("http"), page.find("http-equiv")) << "no address of anywhere";

    const auto stats = nlohmann::json::parse(bytes_of(folder / "s.json"));
    const auto& points = stats.at("points");
    ASSERT_EQ(points.size(), 4u);
    EXPECT_LE(stats.at("reference").at("mean_relative_error").get<double>(), 0.08);
    const auto error = [&](int i) {
        return points[static_cast<std::size_t>(i)].at("indirect").at("mean_relative_error").get<double>();
    };
    EXPECT_LT(error(1), error(0)) << "finer settings are better";
    EXPECT_LT(error(3), error(2)) << "more paths are better";
    for (const auto& point : points) EXPECT_GT(point.at("seconds").get<double>(), 0.0);

    // Nothing is measured anew: the same times, to the last digit, in the same page.
    const Outcome second = rcsplat(small_accuracy(report));
    ASSERT_EQ(second.code, 0) << second.err;
    EXPECT_EQ(bytes_of(report + "/curve.csv"), csv);
    EXPECT_EQ(bytes_of(report + "/index.html"), page);

    // One point is lost: it is measured again, the others stay.
    const std::string cache = report + "/rcsplat-cache";
    std::vector<std::string> kept;
    for (const auto& entry : std::filesystem::directory_iterator(cache)) {
        if (std::filesystem::exists(entry.path() / "point.json")) kept.push_back(entry.path().string());
    }
    ASSERT_EQ(kept.size(), 4u);
    std::filesystem::remove(kept[0] + "/point.json");
    ASSERT_EQ(rcsplat(small_accuracy(report)).code, 0);
    EXPECT_TRUE(std::filesystem::exists(kept[0] + "/point.json")) << "the same point under the same key";

    // Afresh: other times.
    ASSERT_EQ(rcsplat(small_accuracy(report, {"--fresh"})).code, 0);
    EXPECT_NE(bytes_of(report + "/curve.csv"), csv);
}

TEST(AccuracyCommand, ErrorsDoNotDependOnThreads)
{
    const TemporaryFolder folder;
    std::vector<nlohmann::json> errors;
    for (const std::string threads : {"1", "2"}) {
        const Outcome outcome = rcsplat(small_accuracy(folder / threads, {"--threads", threads, "--json"}));
        ASSERT_EQ(outcome.code, 0) << outcome.err;
        nlohmann::json found;
        const auto json = nlohmann::json::parse(outcome.out);
        for (const auto& point : json.at("points")) found.push_back({point.at("indirect"), point.at("beauty")});
        found.push_back(json.at("reference").at("mean_relative_error"));
        errors.push_back(found);
    }
    EXPECT_EQ(errors[0], errors[1]);
}

TEST(AccuracyCommand, BadValuesNameTheOptionAndTheValue)
{
    const TemporaryFolder folder;
    struct Case {
        std::string option, value, said;
    };
    std::vector<Case> cases{{"--reference-error", "0", "reference_error is 0,"},
                            {"--bounces", "0", "bounces is 0,"},
                            {"--reference-spp", "8", "reference_spp is 8,"},
                            {"--size", "0x4", "width is 0,"}};
    for (const char* points : {"1", "11", "many", "0.2:64", "0.2:64:x", "2:64:.1"})
        cases.push_back({"--points", points, points + std::string(" ")});
    for (const char* samples : {"48", "x"}) cases.push_back({"--path-samples", samples, samples + std::string(" ")});
    for (const Case& c : cases) {
        const std::vector<std::string> arguments{"accuracy", "demo:cornell", "-o", folder / "r", c.option, c.value};
        expect_error(arguments, kBadUsage, c.option + ": " + c.said, folder);
    }
    expect_error({"accuracy", "demo:cornell"}, kBadUsage, "--output", folder);
    expect_error({"accuracy", folder / "none.glb", "-o", folder / "r"}, kFailure, "none.glb", folder);
    expect_error({"accuracy", "demo:cornell", "-o", folder / "r", "--camera", "nope"}, kFailure, "nope", folder);
    test::write_bytes(folder / "file", "");
    expect_error({"accuracy", "demo:cornell", "-o", folder / "file"}, kFailure, "file", folder);
    expect_error({"accuracy", "demo:cornell", "-o", "/proc/report"}, kFailure, "/proc/report", folder);
}

}  // namespace
}  // namespace rcs
