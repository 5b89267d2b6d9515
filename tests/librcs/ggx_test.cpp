// The microfacet distribution by itself.
#include "material/ggx.h"

#include <numbers>

#include <gtest/gtest.h>

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;

/// Projected area of all facets, over their slopes up to so many times the peak's width, in units of the whole.
double area(float alpha, float peak, double widths)
{
    constexpr int kSteps = 20000;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        const double step = widths * static_cast<double>(peak) / kSteps, slope = (i + 0.5) * step, t2 = slope * slope;
        const auto d = static_cast<double>(ggx_spread_distribution(static_cast<float>(t2 / (1.0 + t2)), alpha, peak));
        sum += d * 2.0 * kPi * slope * step / ((1.0 + t2) * (1.0 + t2));
    }
    // Beyond that GGX has a^2 / (a^2 + t^2).
    const double a2 = static_cast<double>(alpha) * static_cast<double>(alpha),
                 most = widths * static_cast<double>(peak);
    return sum + a2 / (a2 + most * most);
}

// Whatever of its peak is spread: the area stays, far beside it nothing changes, and it is about as high as that of the
// wider lobe.
TEST(GgxSpreadDistribution, KeepsAreaAndTails)
{
    for (const float alpha : {1e-3f, 0.03f, 0.2f, 0.5f})
        for (const float peak : {1.001f * alpha, alpha + 0.02f, 2.0f * alpha, 0.75f, 1.2f}) {
            EXPECT_NEAR(area(alpha, peak, 4.0), 1.0, 2e-3) << alpha << ' ' << peak;
            for (float slope = 1.42f * peak; slope < 20.0f; slope *= 1.5f) {
                const float sine2 = slope * slope / (1.0f + slope * slope);
                EXPECT_EQ(ggx_spread_distribution(sine2, alpha, peak), ggx_distribution(sine2, alpha)) << alpha;
            }
            const float height = ggx_spread_distribution(0.0f, alpha, peak) / ggx_distribution(0.0f, peak);
            EXPECT_GT(height, 0.99f) << alpha << ' ' << peak;
            EXPECT_LT(height, 1.13f) << alpha << ' ' << peak;
        }
}

}  // namespace
}  // namespace rcs
