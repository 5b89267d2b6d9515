#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/rcsplat.h"

namespace rcs::test {
namespace {

using Json = nlohmann::json;

TEST(DoctorCommand, SaysWhatTheMachineIsAndThatACaseHolds)
{
    const Outcome outcome = rcsplat({"doctor", "--case", "A4", "--case", "B1", "--json"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    for (const char* fact : {"OpenGL platform", "OpenGL vendor", "OpenGL renderer", "OpenGL version", "float blending",
                             "largest texture", "Embree", "Embree instruction set", "OpenColorIO configuration",
                             "OpenImageIO formats", "threads", "memory free"})
        EXPECT_FALSE(json["machine"].value(fact, "").empty()) << fact;
    EXPECT_EQ(json["machine"]["float blending"], "24 bits (single precision)");
    ASSERT_EQ(json["cases"].size(), 2u);
    for (const Json& row : json["cases"]) {
        EXPECT_EQ(row["verdict"], "pass");
        EXPECT_LE(row["figure"].get<double>(), row["tolerance"].get<double>());
        EXPECT_FALSE(row["reason"].get<std::string>().empty());
    }
}

TEST(DoctorCommand, EndsWithAnErrorAndLeavesAReproducerWhereACaseFails)
{
    // Pictures of two pixels are so coarse that a turned room does not look the same.
    const TemporaryFolder folder;
    const Outcome outcome =
        rcsplat({"doctor", "--scene", "demo:atrium", "--size", "2x1", "--case", "rotate", "--save", folder / "found"});
    EXPECT_EQ(outcome.code, kFailure) << outcome.out;
    EXPECT_NE(outcome.err.find("1 of 1 cases failed"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.out.find("FAIL  rotate"), std::string::npos) << outcome.out;
    EXPECT_NE(bytes_of(folder / "found/rotate/README.md").find("rcsplat"), std::string::npos);
    EXPECT_FALSE(bytes_of(folder / "found/rotate/scene.glb").empty());
}

TEST(DoctorCommand, ListsItsCasesWithoutRunningThem)
{
    const Outcome outcome = rcsplat({"doctor", "--list"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    for (const char* id : {"A1 ", "B6 ", "C2 ", "D1 ", "E8 ", "F1 ", "G4 "})
        EXPECT_NE(outcome.out.find(id), std::string::npos) << id;
}

TEST(DoctorCommand, NamesWhatIsWrongWithItsArguments)
{
    const TemporaryFolder folder;
    expect_error({"doctor", "--case", "Z9"}, kBadUsage, "Z9", folder);
    expect_error({"doctor", "--camera", "front"}, kBadUsage, "--scene", folder);
    expect_error({"doctor", "--scene", folder / "no.glb"}, kFailure, "no.glb", folder);
}

}  // namespace
}  // namespace rcs::test
