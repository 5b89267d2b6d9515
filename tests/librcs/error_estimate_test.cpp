#include "accuracy/error_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "rcs/rcs.h"
#include "support/session.h"

namespace rcs {
namespace {

/// What records say of one pixel: luminance of each (grey), with weight and variance.
struct Voice {
    float weight, luminance, variance;
};

/// All pixels hear the same records.
SplatBuffer heard(int width, int height, const std::vector<Voice>& voices, float unit = 1.0f)
{
    SplatBuffer sums;
    sums.width = width;
    sums.height = height;
    sums.luminance_unit = unit;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    for (auto* plane : {&sums.weighted_r, &sums.weighted_g, &sums.weighted_b, &sums.weight, &sums.count, &sums.squares,
                        &sums.variance, &sums.variance_of_sum})
        plane->assign(pixels, 0.0f);
    for (const Voice& v : voices) {
        for (std::size_t i = 0; i < pixels; ++i) {
            for (auto* plane : {&sums.weighted_r, &sums.weighted_g, &sums.weighted_b})
                (*plane)[i] += v.weight * v.luminance;
            sums.weight[i] += v.weight;
            sums.count[i] += 1.0f;
            sums.squares[i] += v.weight * (v.luminance / unit) * (v.luminance / unit);
            sums.variance[i] += v.weight * v.variance / (unit * unit);
            sums.variance_of_sum[i] += v.weight * v.weight * v.variance / (unit * unit);
        }
    }
    return sums;
}

/// Of sums that are one splat's.
ErrorMap map_of(const SplatBuffer& sums)
{
    ThreadPool pool(2);
    return error_map(sums, {1, 36 * 36}, 3.0f, pool);
}

TEST(ErrorMap, OfNoiseAloneIsThatOfTheWeightedMean)
{
    // Sigma^2 = (0.25 * 4 + 1 * 1) / 1.5^2 around a mean of 10, all records alike.
    for (const float unit : {1.0f, 1e-15f, 1e15f}) {
        const ErrorMap map = map_of(heard(4, 3, {{0.5f, 10.0f, 4.0f}, {1.0f, 10.0f, 1.0f}}, unit));
        EXPECT_NEAR(map.noise[5], std::sqrt(2.0f) / 1.5f / 10.0f, 1e-6f);
        EXPECT_EQ(map.spread[5], 0.0f) << "less than the noise would make";
        EXPECT_EQ(map.total(5), map.noise[5]);
    }
}

TEST(ErrorMap, SpreadIsInProportionToTheDisagreement)
{
    const auto spread = [](float by) {
        return map_of(heard(4, 3, {{1.0f, 10.0f - by, 0.0f}, {1.0f, 10.0f + by, 0.0f}})).spread[7];
    };
    EXPECT_GT(spread(1.0f), 0.03f);
    EXPECT_LT(spread(1.0f), 0.1f) << "the mean is nearer to the truth than each of them";
    EXPECT_NEAR(spread(2.0f), 2.0f * spread(1.0f), 1e-5f);
    EXPECT_EQ(spread(0.0f), 0.0f);
}

TEST(ErrorMap, NoiseIsNotTakenForSpread)
{
    // Forty records of one truth and a known noise: what they differ by is explained.
    std::mt19937 engine(3);
    std::normal_distribution<float> noise(0.0f, 0.5f);
    double spread = 0.0, of_noise = 0.0;
    for (int trial = 0; trial < 50; ++trial) {
        std::vector<Voice> voices;
        for (int k = 0; k < 40; ++k) voices.push_back({1.0f, 10.0f + noise(engine), 0.25f});
        const ErrorMap map = map_of(heard(1, 1, voices));
        spread += static_cast<double>(map.spread[0]) / 50.0;
        of_noise += static_cast<double>(map.noise[0]) / 50.0;
    }
    EXPECT_NEAR(of_noise, 0.05 / std::sqrt(40.0), 1e-4);
    EXPECT_LT(spread, 0.0125) << "of a deviation of 0.05";
}

TEST(ErrorMap, AveragesSpreadOverAWindowOfTheDistanceBetweenRecords)
{
    SplatBuffer sums = heard(41, 41, {{1.0f, 10.0f, 0.0f}, {1.0f, 10.0f, 0.0f}});
    const std::size_t middle = 20 * 41 + 20;
    sums.squares[middle] += 2.0f;
    const ErrorMap map = map_of(sums);  // 36 px wide, overlap 3: 6 px from record to record
    EXPECT_GT(map.spread[middle], 0.0f);
    EXPECT_EQ(map.spread[middle], map.spread[middle + 6 * 41 - 6]) << "the window's corner";
    EXPECT_EQ(map.spread[middle + 7], 0.0f);
}

TEST(ErrorMap, IsZeroWhereNoRecordOrNoLightIs)
{
    for (const std::vector<Voice>& voices : {std::vector<Voice>{}, std::vector<Voice>{{1.0f, 0.0f, 0.0f}}}) {
        const ErrorMap map = map_of(heard(3, 3, voices));
        EXPECT_EQ(map.total(4), 0.0f);
    }
}

LayeredImage with_errors(const std::vector<float>& light, const std::vector<float>& error)
{
    LayeredImage image;
    const int n = static_cast<int>(light.size());
    image.layers["indirect"] = Image(n, 1, 3);
    image.layers["indirect_error"] = Image(n, 1, 1);
    for (std::size_t i = 0; i < light.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) image.layers["indirect"].pixels[3 * i + c] = light[i];
        image.layers["indirect_error"].pixels[i] = error[i];
    }
    return image;
}

TEST(EstimateError, OfANormalErrorHasItsMeanMedianAndPercentile)
{
    const ErrorEstimate e =
        estimate_errors(with_errors(std::vector<float>(100, 2.0f), std::vector<float>(100, 0.2f))).indirect;
    const double sigma = 0.2 / (2.0 + 0.01 * 2.0);
    EXPECT_NEAR(e.mean_relative, 0.797885 * sigma, 1e-6);
    EXPECT_NEAR(e.median_relative, 0.674490 * sigma, 0.03 * sigma) << "bins are a 16th of an octave wide";
    EXPECT_NEAR(e.p95_relative, 1.959964 * sigma, 0.08 * sigma);
}

TEST(EstimateError, TellsWhatCompareMeasuresOnSuchErrors)
{
    std::mt19937 engine(5);
    std::normal_distribution<float> normal(0.0f, 1.0f);
    std::vector<float> light, error, off;
    for (int i = 0; i < 20000; ++i) {
        light.push_back(std::exp(normal(engine)));
        error.push_back(0.05f * light.back() * std::exp(0.5f * normal(engine)));
        off.push_back(light.back() + error.back() * normal(engine));
    }
    const ErrorEstimate e = estimate_errors(with_errors(off, error)).indirect;
    const ErrorMetrics m = compare_images(with_errors(off, error), with_errors(light, error), "indirect");
    EXPECT_NEAR(e.mean_relative, m.mean_relative_error, 0.05 * m.mean_relative_error);
    EXPECT_NEAR(e.median_relative, m.median_relative_error, 0.05 * m.median_relative_error);
    EXPECT_NEAR(e.p95_relative, m.p95_relative_error, 0.08 * m.p95_relative_error);
}

TEST(EstimateError, OfNothingIsNothing)
{
    for (const ErrorEstimate& e : {estimate_errors({}).indirect, estimate_errors({}).image,
                                   estimate_errors(with_errors({0.0f, 0.0f}, {0.0f, 0.0f})).indirect}) {
        EXPECT_EQ(e.mean_relative, 0.0);
        EXPECT_EQ(e.p95_relative, 0.0);
    }
}

TEST(EstimateError, CountsLightThatIsNotFiniteAsWrong)
{
    const float infinity = std::numeric_limits<float>::infinity(), nothing = std::numeric_limits<float>::quiet_NaN();
    std::vector<float> light(1000, 2.0f), error(1000, 0.02f);
    const double sound = estimate_errors(with_errors(light, error)).indirect.mean_relative;
    for (std::size_t i = 0; i < 100; ++i) {
        (i % 2 == 0 ? light : error)[10 * i] = i % 4 < 2 ? infinity : nothing;
    }
    const ErrorEstimate e = estimate_errors(with_errors(light, error)).indirect;
    EXPECT_NEAR(e.mean_relative, 0.9 * sound + 0.1 * 2.0, 0.1 * sound);
    EXPECT_GT(e.p95_relative, 1.0);
    light.assign(1000, nothing);
    EXPECT_EQ(estimate_errors(with_errors(light, error)).indirect.mean_relative, 2.0);
}

/// The whole estimate against a path-traced reference: within the factor that the documentation promises.
TEST(EstimateError, OfARenderIsAboutItsError)
{
    const Scene scene = load_scene("demo:cornell");
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const View view{scene.cameras[0], 96, 96, {0.5, 0.5}};
    ReferenceOptions paths;
    paths.samples = 4096;
    paths.stride = 3;
    const LayeredImage reference = render_reference(rays, view, paths, pool);
    for (const float accuracy : {0.2f, 0.4f}) {
        RenderOptions options;
        options.width = options.height = 96;
        options.aa = 1;
        settings_of(options).error_tolerance = accuracy;
        settings_of(options).noise_target = accuracy / 2.0f;
        const RenderResult result = test::render_first(scene, options);
        const double measured = compare_images(result.image, reference, "indirect").mean_relative_error;
        EXPECT_GT(result.stats.errors.indirect.mean_relative, measured / 1.5) << accuracy;
        EXPECT_LT(result.stats.errors.indirect.mean_relative, measured * 1.6)
            << accuracy << ", with what noise the reference has";
    }
}

}  // namespace
}  // namespace rcs
