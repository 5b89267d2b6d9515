#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "rcs/reference.h"
#include "support/tracing.h"

namespace rcs {
namespace {

constexpr int kSize = 16;

/// Layers of both agree within `relative` of their value, or of the layer's mean.
void expect_close(const LayeredImage& a, const LayeredImage& b, float relative)
{
    for (const auto& [name, layer] : b.layers) {
        const Image& other = a.layers.at(name);
        ASSERT_EQ(other.pixels.size(), layer.pixels.size());
        for (std::size_t i = 0; i < layer.pixels.size(); ++i) {
            if (std::isinf(layer.pixels[i])) {
                ASSERT_EQ(other.pixels[i], layer.pixels[i]) << name;
                continue;
            }
            ASSERT_NEAR(other.pixels[i], layer.pixels[i], relative * (std::abs(layer.pixels[i]) + 0.01f)) << name;
        }
    }
}

TEST(MergeReferences, GivesWhatTracingInOneGoGives)
{
    for (const int aa : {1, 4}) {
        const Scene scene = aa == 1 ? test::furnished_room() : test::furnace(0.5f, 1.0f);
        LayeredImage whole = test::trace(scene, kSize, {.samples = 64, .aa = aa});
        LayeredImage sum;
        for (const int first : {0, 16, 32}) {
            const int samples = first == 32 ? 32 : 16;
            merge_references(sum, test::trace(scene, kSize, {.samples = samples, .first_sample = first, .aa = aa}));
        }
        EXPECT_EQ(sum.metadata.at("rcs:samples"), "64");
        for (const char* name : {"standard_error", "indirect_standard_error"}) {
            // Of blocks of other sizes: estimates that scatter. Their means agree to a third.
            EXPECT_NEAR(test::mean(sum, name), test::mean(whole, name), 0.33 * test::mean(whole, name)) << name;
            whole.layers.erase(name);
        }
        whole.layers.erase(aa == 1 ? "" : "normal");  // a mean of unit means is not the unit mean of all
        expect_close(sum, whole, 1e-5f);              // sums in double precision, kept as floats in between
    }
}

TEST(MergeReferences, TakesAnIndependentImageOfAnotherSeed)
{
    const Scene scene = test::furnished_room();
    const LayeredImage a = test::trace(scene, kSize, {.samples = 16, .seed = 1});
    const LayeredImage b = test::trace(scene, kSize, {.samples = 48, .seed = 2});
    LayeredImage sum = a;
    merge_references(sum, b);
    EXPECT_EQ(sum.metadata.at("rcs:samples"), "64");
    EXPECT_EQ(sum.metadata.at("rcs:seed"), "1,2");
    const auto value = [](const LayeredImage& image) { return image.layers.at("indirect").at(5, 9)[1]; };
    EXPECT_NEAR(value(sum), 0.25f * value(a) + 0.75f * value(b), 1e-6f * value(sum));
}

TEST(MergeReferences, RefusesWhatDoesNotFitByName)
{
    const Scene scene = test::furnace(0.5f, 1.0f);
    const LayeredImage first = test::trace(scene, 4, {.samples = 16});
    const std::pair<ReferenceOptions, std::string> cases[] = {
        {{.samples = 16}, "does not begin at the sample where the first ends"},
        {{.samples = 16, .first_sample = 32}, "does not begin at the sample where the first ends"},
        {{.samples = 16, .first_sample = 16, .bounces = 2}, "rcs:bounces is 1 in one and 2 in the other"},
        {{.samples = 16, .first_sample = 16, .aa = 2}, "rcs:aa"}};
    for (const auto& [options, message] : cases) {
        LayeredImage sum = first;
        try {
            merge_references(sum, test::trace(scene, 4, options));
            FAIL() << message;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::bad_argument);
            EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
        }
        EXPECT_EQ(sum.layers.at("beauty").pixels, first.layers.at("beauty").pixels) << "is left as it was";
    }
    LayeredImage sum = first;
    EXPECT_THROW(merge_references(sum, test::trace(scene, 5, {.samples = 16, .first_sample = 16})), Error);
}

}  // namespace
}  // namespace rcs
