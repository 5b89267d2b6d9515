#include "compose/goal.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace rcs {
namespace {

RenderOptions with_budget(double seconds)
{
    RenderOptions options;
    options.aa = 3;
    if (seconds > 0.0) options.quality = Budget{seconds};
    return options;
}

TEST(Goal, WantsAllPassesWhereTimeIsNoMatter)
{
    for (const double budget : {0.0, 1000.0}) {
        const RenderOptions options = with_budget(budget);
        Goal goal(options);
        for (int done = 0; done < 3; ++done) EXPECT_TRUE(goal.wants_pass(done)) << done;
        EXPECT_FALSE(goal.wants_pass(3));
        EXPECT_EQ(goal.passes(), 3);
    }
}

TEST(Goal, LeavesOutPassesThatItHasNoTimeFor)
{
    const RenderOptions options = with_budget(1e-3);
    Goal goal(options);
    EXPECT_TRUE(goal.wants_pass(0)) << "there has to be a picture";
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_FALSE(goal.wants_pass(1));
    EXPECT_EQ(goal.passes(), 1);
}

}  // namespace
}  // namespace rcs
