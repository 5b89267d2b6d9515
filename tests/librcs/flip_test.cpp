#include "accuracy/flip.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace rcs {
namespace {

constexpr int kWidth = 96, kHeight = 64;

/// The picture whose colour c at (x, y) is value(x, y, c).
template <typename Value>
Image picture(const Value& value)
{
    Image image(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(value(x, y, c));
    return image;
}

double waves(double x, double y, int c) { return 0.5 + 0.4 * std::sin(0.11 * x * (c + 1) + 0.07 * y); }

/// As told by the authors' flip-evaluator 1.7 for the same linear colours at its default viewing distance.
TEST(Flip, IsWhatItsAuthorsToolSays)
{
    const Image reference = picture(waves);
    const auto flip = [&](const auto& value) { return mean_flip(picture(value), reference); };
    EXPECT_EQ(mean_flip(reference, reference), 0.0);
    EXPECT_NEAR(flip([](int x, int y, int c) { return std::min(1.0, 1.2 * waves(x, y, c)); }), 0.309464, 2e-4);
    EXPECT_NEAR(flip([](int x, int y, int c) { return waves(x + 3, y, c); }), 0.640586, 2e-4);
    EXPECT_NEAR(flip([](int x, int y, int c) {
                    return std::clamp(waves(x, y, c) + 0.1 * std::sin(2.3 * x + 3.1 * y), 0.0, 1.0);
                }),
                0.001872, 2e-4);
    EXPECT_NEAR(flip([](int x, int y, int c) { return y % 16 == 5 && x % 16 == 7 ? 1.0 : waves(x, y, c); }), 0.019919,
                2e-4);
}

TEST(Flip, OfOppositesIsAboutOne)
{
    const auto only = [](int color) { return picture([color](int, int, int c) { return c == color ? 1.0 : 0.0; }); };
    EXPECT_NEAR(mean_flip(only(2), only(1)), 1.0, 1e-6);
    const Image black = picture([](int, int, int) { return 0.0; }), white = picture([](int, int, int) { return 1.0; });
    EXPECT_NEAR(mean_flip(white, black), 0.967325, 2e-4);
}

TEST(Flip, ClipsColorsAndPassesOverWhatIsNotFinite)
{
    Image bright = picture([](int, int, int) { return 1.0; }), brighter = picture([](int, int, int) { return 9.0; });
    EXPECT_EQ(mean_flip(bright, brighter), 0.0);
    brighter.at(3, 4)[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(mean_flip(bright, brighter), 0.0);
}

}  // namespace
}  // namespace rcs
