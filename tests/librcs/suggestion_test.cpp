#include "rcs/suggestion.h"

#include <gtest/gtest.h>

namespace rcs {
namespace {

const std::vector<std::string> kNames = {"render", "reference", "--size", "--seed", "demo:atrium", "demo:ajar"};

TEST(ClosestName, IsFoundFromWrongSwappedMissingAndStrangeLetters)
{
    EXPECT_EQ(closest_name("rendr", kNames), "render");
    EXPECT_EQ(closest_name("redner", kNames), "render");
    EXPECT_EQ(closest_name("RENDER", kNames), "render");
    EXPECT_EQ(closest_name("refrence", kNames), "reference");
    EXPECT_EQ(closest_name("--sise", kNames), "--size");
    EXPECT_EQ(closest_name("atrium", kNames), "demo:atrium") << "a part of the name";
}

TEST(ClosestName, IsNoneWhereNothingIsNear)
{
    EXPECT_EQ(closest_name("paint", kNames), "");
    EXPECT_EQ(closest_name("", kNames), "");
    EXPECT_EQ(closest_name("r", kNames), "");
    EXPECT_EQ(closest_name(std::string(100'000, 'r'), kNames), "") << "and is not looked for in a whole file";
    EXPECT_EQ(closest_name("render", {}), "");
}

TEST(DidYouMean, AsksOnlyWhereItKnows)
{
    EXPECT_EQ(did_you_mean("rendr", kNames), "; did you mean 'render'?");
    EXPECT_EQ(did_you_mean("paint", kNames), "");
}

}  // namespace
}  // namespace rcs
