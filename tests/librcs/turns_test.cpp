#include "util/turns.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace rcs {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

TEST(Turns, SineIsThatOfTheLibrary)
{
    for (int k = -500; k < 1500; ++k) {
        const double t = k / 1000.0;
        EXPECT_NEAR(static_cast<double>(sine_of_turns(static_cast<float>(t))), std::sin(kTurn * t), 5e-7) << t;
    }
}

TEST(Turns, AngleIsThatOfTheLibrary)
{
    for (int k = 0; k < 1000; ++k)
        for (const double length : {1e-20, 0.3, 1.0, 1e15}) {
            const double t = k / 1000.0;
            const auto x = static_cast<float>(length * std::cos(kTurn * t)),
                       y = static_cast<float>(length * std::sin(kTurn * t));
            const double apart = static_cast<double>(turns_of(x, y)) - t;
            EXPECT_NEAR(apart - std::round(apart), 0.0, 2e-6) << t << ", " << length;
            EXPECT_GE(turns_of(x, y), 0.0f);
            EXPECT_LE(turns_of(x, y), 1.0f);
        }
}

TEST(Turns, AxesAreExact)
{
    EXPECT_EQ(turns_of(0.0f, 0.0f), 0.0f);
    EXPECT_EQ(turns_of(1.0f, 0.0f), 0.0f);
    EXPECT_NEAR(turns_of(0.0f, 1.0f), 0.25f, 1e-7f);
    EXPECT_NEAR(turns_of(-1.0f, 0.0f), 0.5f, 1e-7f);
    EXPECT_NEAR(turns_of(0.0f, -1.0f), 0.75f, 1e-7f);
}

}  // namespace
}  // namespace rcs
