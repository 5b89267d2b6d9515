// What a filter is allowed to change, and what is said of it. A library of the tests' own stands in for Open Image
// Denoise; what the true one does is tested where $RCSPLAT_OIDN names its folder.

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "denoise/mixture.h"
#include "denoise/oidn.h"
#include "rcs/rcs.h"
#include "support/session.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr const char* kFolder = "RCSPLAT_OIDN";

/// Lets the library be looked for in a folder, for as long as this lasts.
class LookIn {
public:
    explicit LookIn(const std::string& folder) : before_(std::getenv(kFolder) ? std::getenv(kFolder) : "")
    {
        setenv(kFolder, folder.c_str(), 1);
    }
    ~LookIn() { before_.empty() ? unsetenv(kFolder) : setenv(kFolder, before_.c_str(), 1); }
    LookIn(const LookIn&) = delete;

private:
    std::string before_;
};

constexpr const char* kStandIn = RCS_BIN_DIR "/oidn-20300";

/// Sums of 12 uniform numbers, less their mean: about normal, of variance 1.
double normal(RandomStream& random)
{
    double sum = -6.0;
    for (int k = 0; k < 12; ++k) sum += static_cast<double>(random.next());
    return sum;
}

/// Checks of pixels with light 1, whose noise is `noise()`; `filtered()` is what a filter makes of it.
template <typename Noise, typename Filtered>
std::vector<FilterCheck> checks_of(double error, const Noise& noise, const Filtered& filtered)
{
    std::vector<FilterCheck> checks;
    RandomStream random(7);
    for (int k = 0; k < 1000; ++k) {
        FilterCheck c{.sampled = 1.0 + noise(random), .filtered = 0.0, .error = error, .light = 1.0};
        c.filtered = filtered(random);
        for (double& again : c.again) again = 1.0 + noise(random);
        checks.push_back(c);
    }
    return checks;
}

TEST(FilterMixture, TakesWhatIsFilteredWhereThatIsRight)
{
    const FilterMixture mixture(checks_of(
        0.3, [](RandomStream& r) { return 0.3 * normal(r); }, [](RandomStream& r) { return 1.0 + 0.05 * normal(r); }));
    EXPECT_GT(mixture.filtered(0.3), 0.9);
    EXPECT_LT(mixture.left(0.3), 0.13);
}

TEST(FilterMixture, LeavesAloneWhatAFilterBlurs)
{
    const FilterMixture mixture(checks_of(
        0.02, [](RandomStream& r) { return 0.02 * normal(r); }, [](RandomStream& r) { return 1.0 + 0.5 * normal(r); }));
    EXPECT_LT(mixture.filtered(0.02), 0.01);
    EXPECT_NEAR(mixture.left(0.02), 0.02, 1e-6);
}

TEST(FilterMixture, SaysTheErrorOfAFilterThatIsOff)
{
    for (const double off : {0.2, 0.4}) {
        const FilterMixture mixture(
            checks_of(0.5, [](RandomStream& r) { return 0.5 * normal(r); }, [&](RandomStream&) { return 1.0 + off; }));
        // Of a constant offset and noise, the least squares of a mixture.
        const double share = 0.25 / (0.25 + off * off);
        EXPECT_NEAR(mixture.filtered(0.5), share, 0.1) << off;
        const double left = std::sqrt(share * share * off * off + (1.0 - share) * (1.0 - share) * 0.25);
        EXPECT_NEAR(mixture.left(0.5), left, 0.35 * left) << off;  // which 200 checks tell
    }
}

TEST(FilterMixture, IsNotDeceivedByRareSparks)
{
    const auto spark = [](RandomStream& r) { return r.next() < 0.05f ? 19.0 : -1.0; };
    const FilterMixture mixture(checks_of(std::sqrt(19.0), spark, [](RandomStream&) { return 1.0; }));
    EXPECT_GT(mixture.filtered(4.0), 0.9);
    EXPECT_LT(mixture.left(4.0), 2.5) << "of 4.4";
}

TEST(FilterMixture, OfFewChecksNothingIsKnown)
{
    std::vector<FilterCheck> few =
        checks_of(0.3, [](RandomStream& r) { return 0.3 * normal(r); }, [](RandomStream&) { return 1.0; });
    few.resize(10);
    EXPECT_EQ(FilterMixture(few).filtered(0.3), 0.0);
    EXPECT_EQ(FilterMixture({}).filtered(0.3), 0.0);
}

/// Without bounces no records gather the lamp of demo:blinds: pixels sample it.
RenderOptions options_of(Denoiser denoise, int bounces, int passes = 1)
{
    RenderOptions o;
    o.width = 160, o.height = 90, o.aa = passes, o.denoise = denoise, o.bounces = bounces;
    o.area_samples = o.penumbra_samples = 4;
    o.effects.with.set(Effect::error_estimate);
    return o;
}

std::string refusal_in(const std::string& folder)
{
    const LookIn look(folder);
    const Scene scene = load_scene("demo:blinds");
    try {
        test::render_first(scene, options_of(Denoiser::oidn, 0));
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::unsupported);
        return e.what();
    }
    return "";
}

TEST(Denoise, WithoutTheLibraryItIsRefusedAndSaysWhatToInstall)
{
    const std::string said = refusal_in("/nowhere");
    EXPECT_NE(said.find("/nowhere/libOpenImageDenoise.so.2"), std::string::npos) << said;
    EXPECT_NE(said.find("install it (PyPI: pyoidn)"), std::string::npos) << said;
    EXPECT_NE(said.find(kFolder), std::string::npos) << said;
}

TEST(Denoise, AnotherVersionIsRefused)
{
    EXPECT_EQ(refusal_in(RCS_BIN_DIR "/oidn-10403"),
              "cannot denoise: Open Image Denoise is of version 1.4.3, expected 2");
}

const DenoisedLight& light_of(const RenderResult& result, const std::string& name)
{
    for (const DenoisedLight& light : result.stats.denoised.lights)
        if (light.name == name) return light;
    throw std::runtime_error("there is no " + name);
}

TEST(Denoise, DirectLightBehindBlindsIsFilteredAndSaysSo)
{
    const LookIn look(kStandIn);
    const Scene scene = load_scene("demo:blinds");
    const RenderResult plain = test::render_first(scene, options_of(Denoiser::none, 0));
    const RenderResult filtered = test::render_first(scene, options_of(Denoiser::oidn, 0));
    EXPECT_EQ(filtered.stats.denoised.library, "Open Image Denoise 2.3.0");
    EXPECT_EQ(filtered.stats.denoised.device, "CPU");
    const DenoisedLight& direct = light_of(filtered, "direct");
    EXPECT_GT(direct.filtered, 0.1);
    EXPECT_LT(direct.error_after, 0.9 * direct.error_before);
    EXPECT_EQ(filtered.stats.denoised.before.image.mean_relative, plain.stats.errors.image.mean_relative);
    EXPECT_LT(filtered.stats.errors.image.mean_relative, plain.stats.errors.image.mean_relative);
    const auto& layers = filtered.image.layers;
    EXPECT_NE(layers.at("direct").pixels, plain.image.layers.at("direct").pixels);
    EXPECT_NE(layers.at("direct_error").pixels, plain.image.layers.at("direct_error").pixels);
    for (std::size_t i = 0; i < layers.at("direct").pixels.size(); ++i) {
        const float sum = layers.at("emission").pixels[i] + layers.at("direct").pixels[i];
        ASSERT_EQ(layers.at("beauty").pixels[i / 3 * 4 + i % 3], sum);
    }
    EXPECT_FALSE(layers.contains("sampled"));
    EXPECT_EQ(filtered.image.metadata.at("rcs:denoise"), "oidn");
    EXPECT_EQ(filtered.image.metadata.at("rcs:denoised-by"), "Open Image Denoise 2.3.0 (CPU)");
    EXPECT_TRUE(filtered.image.metadata.contains("rcs:denoised-direct"));
    EXPECT_TRUE(filtered.image.metadata.contains("rcs:image-error-before-denoising-mean"));
    EXPECT_FALSE(plain.image.metadata.contains("rcs:denoised-by"));
}

TEST(Denoise, BitsDoNotDependOnThreads)
{
    const LookIn look(kStandIn);
    for (const auto& [name, bounces] : {std::pair{"demo:blinds", 0}, {"demo:spheres", 1}}) {
        const Scene scene = load_scene(name);
        const RenderResult one = test::render_first(scene, options_of(Denoiser::oidn, bounces, 2), 1);
        const RenderResult two = test::render_first(scene, options_of(Denoiser::oidn, bounces, 2), 2);
        for (const auto& [layer, image] : one.image.layers)
            EXPECT_EQ(image.pixels, two.image.layers.at(layer).pixels) << name << " " << layer;
    }
}

TEST(Denoise, ExactLightStaysAsItIs)
{
    const LookIn look(kStandIn);
    const Scene scene = load_scene("demo:atrium");  // which the sun lights
    const RenderResult plain = test::render_first(scene, options_of(Denoiser::none, 0));
    const RenderResult filtered = test::render_first(scene, options_of(Denoiser::oidn, 0));
    EXPECT_TRUE(light_of(filtered, "direct").is_exact);
    for (const DenoisedLight& light : filtered.stats.denoised.lights) EXPECT_TRUE(light.is_exact) << light.name;
    for (const auto& [layer, image] : plain.image.layers)
        EXPECT_EQ(image.pixels, filtered.image.layers.at(layer).pixels) << layer;
}

TEST(Denoise, RecordsAndWhatIsExactAreThoseOfAPictureWithoutIt)
{
    const LookIn look(kStandIn);
    const Scene scene = load_scene("demo:spheres");
    const RenderResult plain = test::render_first(scene, options_of(Denoiser::none, 1));
    const RenderResult filtered = test::render_first(scene, options_of(Denoiser::oidn, 1));
    EXPECT_EQ(plain.stats.records.hemisphere_rays, filtered.stats.records.hemisphere_rays);
    EXPECT_LT(filtered.stats.direct_shadow_rays, 1.06 * static_cast<double>(plain.stats.direct_shadow_rays));
    EXPECT_GT(filtered.stats.traced.rays, plain.stats.traced.rays) << "lobes are traced again here and there";
    EXPECT_LT(filtered.stats.traced.rays, 1.06 * static_cast<double>(plain.stats.traced.rays));
    for (const char* layer : {"emission", "albedo", "normal", "irradiance"})
        EXPECT_EQ(plain.image.layers.at(layer).pixels, filtered.image.layers.at(layer).pixels) << layer;
    EXPECT_FALSE(light_of(filtered, "reflections").is_exact);
}

TEST(Denoise, TheTrueLibraryBringsTheErrorDownAsItSays)
{
    if (!std::getenv(kFolder)) GTEST_SKIP() << kFolder << " names no folder of Open Image Denoise 2 (PyPI: pyoidn)";
    const Scene scene = load_scene("demo:blinds");
    RenderOptions few = options_of(Denoiser::none, 0);
    few.width = 320, few.height = 180;
    RenderOptions fine = few, filtered = few;
    fine.area_samples = 128, fine.penumbra_samples = 1024, fine.seed = 99;
    filtered.denoise = Denoiser::oidn;
    const RenderResult truth = test::render_first(scene, fine);
    const auto error_of = [&](const RenderResult& result) {
        return compare_images(result.image, truth.image).mean_relative_error;
    };
    const RenderResult plain = test::render_first(scene, few), clean = test::render_first(scene, filtered, 1);
    EXPECT_LT(error_of(clean), 0.5 * error_of(plain));
    EXPECT_GT(clean.stats.errors.image.mean_relative, 0.67 * error_of(clean));
    EXPECT_LT(clean.stats.errors.image.mean_relative, 1.5 * error_of(clean));
    EXPECT_EQ(clean.image.layers.at("direct").pixels,
              test::render_first(scene, filtered, 2).image.layers.at("direct").pixels);
}

}  // namespace
}  // namespace rcs
