#include "rcs/metrics.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/error.h"

namespace rcs {
namespace {

LayeredImage one_layer(const std::string& name, int width, int height, int channels, std::vector<float> pixels)
{
    LayeredImage image;
    Image layer(width, height, channels);
    layer.pixels = std::move(pixels);
    image.layers[name] = std::move(layer);
    return image;
}

LayeredImage grey(int width, int height, const std::vector<float>& values)
{
    std::vector<float> pixels;
    for (const float v : values) pixels.insert(pixels.end(), {v, v, v});
    return one_layer("beauty", width, height, 3, pixels);
}

LayeredImage scalar_ramp(int width, int height)
{
    std::vector<float> values(static_cast<std::size_t>(width * height));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = 1.0f + static_cast<float>(i);
    return one_layer("depth", width, height, 1, values);
}

TEST(Metrics, EqualImagesHaveNoError)
{
    const LayeredImage image = grey(2, 2, {0.0f, 0.5f, 1.0f, 7.0f});
    const ErrorMetrics m = compare_images(image, image);
    EXPECT_EQ(m.pixels, 4u);
    EXPECT_EQ(m.not_finite, 0u);
    EXPECT_EQ(m.relmse, 0.0);
    EXPECT_EQ(m.rmse, 0.0);
    EXPECT_EQ(m.mean_relative_error, 0.0);
    EXPECT_EQ(m.median_relative_error, 0.0);
    EXPECT_EQ(m.p95_relative_error, 0.0);
    EXPECT_EQ(m.ratio_of_means, 1.0);
    EXPECT_TRUE(std::isinf(m.display_psnr));
}

TEST(Metrics, AgreeWithAHandComputedExample)
{
    // R = 1, 3 (mean 2, eps 0.02); I = 1.1, 2.4.
    const ErrorMetrics m = compare_images(grey(2, 1, {1.1f, 2.4f}), grey(2, 1, {1.0f, 3.0f}));
    const double tolerance = 1e-6;  // single-precision inputs
    EXPECT_NEAR(m.relmse, 0.5 * (0.01 / 1.0004 + 0.36 / 9.0004), tolerance);
    EXPECT_NEAR(m.rmse, std::sqrt(0.5 * (0.01 + 0.36)), tolerance);
    EXPECT_NEAR(m.mean_relative_error, 0.5 * (0.1 / 1.02 + 0.6 / 3.02), tolerance);
    EXPECT_NEAR(m.median_relative_error, 0.1 / 1.02, tolerance);
    EXPECT_NEAR(m.p95_relative_error, 0.6 / 3.02, tolerance);
    EXPECT_NEAR(m.ratio_of_means, 3.5 / 4.0, tolerance);
    EXPECT_TRUE(std::isinf(m.display_psnr)) << "both are clipped to white on a display";
}

TEST(Metrics, PercentilesAreRanks)
{
    // 100 pixels, each R = 1 (eps 0.01), with errors 1 % ... 100 % in a mixed order.
    std::vector<float> image, reference(100, 1.0f);
    for (int i = 0; i < 100; ++i) image.push_back(1.0f + static_cast<float>((i * 37) % 100 + 1) / 100.0f);
    const ErrorMetrics m = compare_images(grey(10, 10, image), grey(10, 10, reference));
    EXPECT_NEAR(m.median_relative_error, 0.50 / 1.01, 1e-6);
    EXPECT_NEAR(m.p95_relative_error, 0.95 / 1.01, 1e-6);
    EXPECT_NEAR(m.mean_relative_error, 0.505 / 1.01, 1e-6);
}

TEST(Metrics, TakeErrorsOnLuminance)
{
    // Red and green errors of opposite sign that cancel in 0.2126 R + 0.7152 G.
    const ErrorMetrics m = compare_images(one_layer("beauty", 1, 1, 3, {0.5f + 0.07152f, 0.5f - 0.02126f, 0.5f}),
                                          one_layer("beauty", 1, 1, 4, {0.5f, 0.5f, 0.5f, 1.0f}));
    EXPECT_NEAR(m.rmse, 0.0, 1e-7);
    EXPECT_LT(m.display_psnr, 40.0) << "the display image does tell them apart";
}

TEST(Metrics, PsnrIsOfTheSrgbEncodedImage)
{
    // Linear 0.2140411 is 0.5 in sRGB, linear 0.6038273 is 0.8: a difference of 0.3 in every colour.
    const ErrorMetrics m = compare_images(grey(1, 1, {0.2140411f}), grey(1, 1, {0.6038273f}));
    EXPECT_NEAR(m.display_psnr, -20.0 * std::log10(0.3), 1e-4);
}

/// 1 + what `error` says of pixel (x, y), against 1.
ErrorMetrics metrics_of(int width, int height, const std::function<double(int, int)>& error)
{
    std::vector<float> image;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) image.push_back(static_cast<float>(1.0 + 1.01 * error(x, y)));
    const std::vector<float> ones(image.size(), 1.0f);
    return compare_images(grey(width, height, image), grey(width, height, ones));
}

TEST(Metrics, LowFrequencyOfWhiteNoiseIsOne)
{
    std::mt19937 engine(7);
    std::normal_distribution<double> normal(0.0, 0.1);
    const ErrorMetrics m = metrics_of(500, 300, [&](int, int) { return normal(engine); });
    EXPECT_NEAR(m.mean_relative_error, 0.1 * std::sqrt(2.0 / std::acos(-1.0)), 0.001);
    EXPECT_NEAR(m.low_frequency_ratio, 1.0, 0.05);
    // sqrt of the sum of the kernel's squares is 1 / (2 sqrt(pi) 8), a little more at the edges.
    EXPECT_NEAR(m.low_frequency_error / m.mean_relative_error, 0.0353, 0.004);
}

TEST(Metrics, LowFrequencySeesCloudsAndNoGrain)
{
    const double pi = std::acos(-1.0);
    const auto waves = [&](double period) {
        return metrics_of(512, 512, [=](int x, int) { return 0.1 * std::sin(2.0 * pi * x / period); });
    };
    // A Gaussian of deviation s leaves exp(-(2 pi s / period)^2 / 2) of a wave.
    const ErrorMetrics wide = waves(128.0), middle = waves(64.0), fine = waves(16.0);
    EXPECT_NEAR(wide.low_frequency_error / wide.mean_relative_error, 0.926, 0.02);
    EXPECT_NEAR(middle.low_frequency_error / middle.mean_relative_error, 0.735, 0.03) << "edges keep a little more";
    EXPECT_LT(fine.low_frequency_error / fine.mean_relative_error, 0.02);
    EXPECT_GT(wide.low_frequency_ratio, 20.0);
    const ErrorMetrics shifted = metrics_of(128, 128, [](int, int) { return -0.1; });
    EXPECT_NEAR(shifted.low_frequency_error, 0.1, 1e-4) << "a picture that is too dark is off at all frequencies";
}

TEST(Metrics, LowFrequencyLeavesOutWhatIsNotFinite)
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const ErrorMetrics m = metrics_of(64, 64, [&](int x, int y) { return x % 5 == 0 && y % 3 == 0 ? nan : 0.1; });
    EXPECT_GT(m.not_finite, 200u);
    EXPECT_NEAR(m.low_frequency_error, 0.1, 1e-4);
    LayeredImage strided = grey(4, 4, std::vector<float>(16, 1.0f));
    strided.metadata["rcs:stride"] = "16";
    const ErrorMetrics none = compare_images(grey(64, 64, std::vector<float>(4096, 1.1f)), strided);
    EXPECT_TRUE(std::isnan(none.low_frequency_error) && std::isnan(none.low_frequency_ratio));
}

TEST(Metrics, KnowTheNoiseOfTheReference)
{
    constexpr int kSide = 200;
    std::mt19937 engine(11);
    std::normal_distribution<float> normal;
    const auto deviation = [](std::size_t i) { return i % 4 == 0 ? 0.04f : 0.005f; };
    std::vector<float> truth(kSide * kSide), noisy(truth.size()), deviations(truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
        truth[i] = i % 2 == 0 ? 1.0f : 3.0f;
        deviations[i] = deviation(i);
        noisy[i] = truth[i] + deviation(i) * normal(engine);
    }
    LayeredImage reference = grey(kSide, kSide, noisy);
    EXPECT_TRUE(std::isnan(compare_images(grey(kSide, kSide, truth), reference).reference_noise));
    reference.layers["standard_error"] = grey(kSide, kSide, deviations).layers.at("beauty");
    const ErrorMetrics m = compare_images(grey(kSide, kSide, truth), reference);
    EXPECT_NEAR(m.reference_noise / m.mean_relative_error, 1.0, 0.02) << "there is no other error";
    LayeredImage crop = grey(kSide / 2, kSide, std::vector<float>(kSide * kSide / 2, 2.0f));
    crop.window = ImageWindow{kSide / 2, 0, kSide, kSide};
    EXPECT_NEAR(compare_images(crop, reference).reference_noise, m.reference_noise, 0.03 * m.reference_noise);
    reference.layers["indirect"] = reference.layers.at("beauty");
    const LayeredImage image{{{"indirect", reference.layers.at("indirect")}}, {}, {}, {}};
    EXPECT_TRUE(std::isnan(compare_images(image, reference, "indirect").reference_noise))
        << "that of beauty is another";
}

TEST(Metrics, CountPixelsThatAreNotFiniteAndLeaveThemOut)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    const ErrorMetrics m = compare_images(grey(2, 2, {1.0f, nan, 2.0f, 5.0f}), grey(2, 2, {1.0f, 1.0f, inf, 5.0f}));
    EXPECT_EQ(m.not_finite, 2u);
    EXPECT_EQ(m.pixels, 2u);
    EXPECT_EQ(m.rmse, 0.0);
    const ErrorMetrics none = compare_images(grey(1, 1, {nan}), grey(1, 1, {nan}));
    EXPECT_EQ(none.pixels, 0u);
    EXPECT_EQ(none.relmse, 0.0);
}

TEST(Metrics, BlackImagesAreEqualToEachOtherAndInfinitelyFarFromOthers)
{
    const LayeredImage black = grey(1, 2, {0.0f, 0.0f});
    const ErrorMetrics same = compare_images(black, black);
    EXPECT_EQ(same.relmse, 0.0);
    EXPECT_EQ(same.ratio_of_means, 1.0);
    const ErrorMetrics lit = compare_images(grey(1, 2, {0.0f, 1.0f}), black);
    EXPECT_TRUE(std::isinf(lit.mean_relative_error));
    EXPECT_TRUE(std::isinf(lit.ratio_of_means));
}

TEST(Metrics, MatchAStridedReferenceToTheSamePixels)
{
    for (const int stride : {1, 2, 3, 4, 7}) {
        const LayeredImage full = scalar_ramp(13, 9);
        std::vector<float> taken;
        int width = 0;
        int height = 0;
        for (int y = stride / 2; y < 9; y += stride, ++height) {
            width = 0;
            for (int x = stride / 2; x < 13; x += stride, ++width) {
                taken.push_back(full.layers.at("depth").at(x, y)[0]);
            }
        }
        LayeredImage reference = one_layer("depth", width, height, 1, taken);
        reference.metadata["rcs:stride"] = std::to_string(stride);
        const ErrorMetrics m = compare_images(full, reference, "depth");
        EXPECT_EQ(m.pixels, taken.size());
        EXPECT_EQ(m.rmse, 0.0) << "stride " << stride;
        EXPECT_EQ(compare_images(reference, reference, "depth").rmse, 0.0) << "two references of one stride";
    }
}

ErrorCode code_of(const LayeredImage& a, const LayeredImage& b, const std::string& layer)
{
    try {
        compare_images(a, b, layer);
    } catch (const Error& e) {
        return e.code();
    }
    return ErrorCode::internal;
}

TEST(Metrics, RefuseImagesThatDoNotMatch)
{
    LayeredImage strided = scalar_ramp(3, 3);
    EXPECT_EQ(code_of(scalar_ramp(6, 6), strided, "depth"), ErrorCode::bad_argument);
    strided.metadata["rcs:stride"] = "2";
    EXPECT_EQ(code_of(scalar_ramp(6, 6), strided, "depth"), ErrorCode::internal) << "these do";
    EXPECT_EQ(code_of(scalar_ramp(7, 6), strided, "depth"), ErrorCode::internal) << "and x = 1, 3, 5 of 7 too";
    EXPECT_EQ(code_of(scalar_ramp(8, 6), strided, "depth"), ErrorCode::bad_argument);
    strided.metadata["rcs:stride"] = "two";
    EXPECT_EQ(code_of(scalar_ramp(6, 6), strided, "depth"), ErrorCode::bad_argument);
    EXPECT_EQ(code_of(scalar_ramp(3, 3), scalar_ramp(3, 3), "beauty"), ErrorCode::not_found);
    EXPECT_EQ(code_of(one_layer("depth", 1, 1, 3, {1.0f, 1.0f, 1.0f}), scalar_ramp(1, 1), "depth"),
              ErrorCode::bad_argument);
}

TEST(Metrics, RelativeDifferenceHasASignAtEachPixel)
{
    // R = 1, 3 (mean 2, eps 0.02); I = 1.1, 2.4.
    const Image d = relative_difference(grey(2, 1, {1.1f, 2.4f}), grey(2, 1, {1.0f, 3.0f}), "beauty");
    ASSERT_EQ(d.channels, 1);
    EXPECT_NEAR(*d.at(0, 0), 0.1 / 1.02, 1e-6);
    EXPECT_NEAR(*d.at(1, 0), -0.6 / 3.02, 1e-6);
    const Image black = relative_difference(grey(1, 1, {0.0f}), grey(1, 1, {0.0f}), "beauty");
    EXPECT_EQ(*black.at(0, 0), 0.0f);
}

}  // namespace
}  // namespace rcs
