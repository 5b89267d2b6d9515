#include "render/course.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace rcs {
namespace {

constexpr int kMost = 3;

TEST(Course, WantsAllPassesWhereTimeIsNoMatter)
{
    for (const Quality& quality : {Quality(QualitySettings{}), Quality(TargetError{0.1}), Quality(Budget{1000.0})}) {
        const Deadline deadline(quality);
        Course course{.passes = kMost};
        for (int done = 0; done < kMost; ++done) EXPECT_TRUE(wants_pass(course, deadline, done, kMost)) << done;
        EXPECT_FALSE(wants_pass(course, deadline, kMost, kMost));
        EXPECT_EQ(course.passes, kMost);
    }
}

TEST(Course, LeavesOutPassesThatThereIsNoTimeFor)
{
    const Deadline deadline(Budget{1e-3});
    Course course{.passes = kMost};
    EXPECT_TRUE(wants_pass(course, deadline, 0, kMost)) << "there has to be a picture";
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_FALSE(wants_pass(course, deadline, 1, kMost));
    EXPECT_EQ(course.passes, 1);
}

TEST(Course, AddsPassesThatFitAfterAll)
{
    const Deadline deadline(Budget{1000.0});
    Course course{.passes = 1};  // as a forecast feared
    EXPECT_TRUE(wants_pass(course, deadline, 0, kMost));
    EXPECT_TRUE(wants_pass(course, deadline, 1, kMost));
    EXPECT_EQ(course.passes, 2);
}

}  // namespace
}  // namespace rcs
