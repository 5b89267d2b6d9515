#include "rcs/tone_map.h"

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "rcs/error.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using test::TemporaryFolder;

/// The tests bring their own $OCIO.
class ToneMap : public testing::Test {
protected:
    void SetUp() override { ::unsetenv("OCIO"); }
    void TearDown() override { ::unsetenv("OCIO"); }
    ThreadPool pool_{2};
};

Image pixels(const std::vector<float>& rgb)
{
    Image image(static_cast<int>(rgb.size() / 3), 1, 3);
    image.pixels = rgb;
    return image;
}

ToneMapOptions at_exposure(float ev, const std::string& view = "")
{
    ToneMapOptions options;
    options.exposure = ev;
    options.view = view;
    return options;
}

/// Encoding of IEC 61966-2-1, written down here once more.
float srgb(float v) { return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f; }

ErrorCode code_of(const std::function<void()>& action, std::string& message)
{
    try {
        action();
    } catch (const Error& e) {
        message = e.what();
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return e.code();
    }
    ADD_FAILURE() << "no error";
    return ErrorCode::internal;
}

TEST_F(ToneMap, BuiltInConfigurationShowsAces10OnSrgb)
{
    const ToneMapper mapper(at_exposure(0.0f));
    EXPECT_EQ(mapper.config_name(), "built-in");
    EXPECT_EQ(mapper.display(), "sRGB");
    EXPECT_EQ(mapper.view(), "ACES 1.0 SDR");
}

TEST_F(ToneMap, UnToneMappedViewIsThePlainSrgbEncoding)
{
    const ToneMapper mapper(at_exposure(0.0f, "Un-tone-mapped"));
    const std::vector<float> values{0.0f, 0.001f, 0.003f, 0.0032f, 0.18f, 0.5f, 0.9f, 1.0f, 4.0f, 0.2f, 0.7f, 0.05f};
    const Image result = mapper.apply(pixels(values), pool_);
    for (std::size_t i = 0; i < values.size(); ++i) {
        // Primaries go through ACES and XYZ and back: 4-digit matrices whose product is not exactly one.
        EXPECT_NEAR(result.pixels[i], srgb(std::min(values[i], 1.0f)), 2e-4f) << values[i];
    }
}

TEST_F(ToneMap, AcesViewKeepsGreysNeutralMonotoneAndOffTheCeiling)
{
    const ToneMapper mapper(at_exposure(0.0f));
    std::vector<float> greys;
    for (int i = 0; i < 400; ++i) {
        const float v = std::exp2(-8.0f + 14.0f * static_cast<float>(i) / 399.0f);
        greys.insert(greys.end(), {v, v, v});
    }
    const Image result = mapper.apply(pixels(greys), pool_);
    for (std::size_t i = 0; i < greys.size(); i += 3) {
        EXPECT_NEAR(result.pixels[i], result.pixels[i + 1], 1e-3f) << "less than a third of an 8-bit step";
        EXPECT_NEAR(result.pixels[i], result.pixels[i + 2], 1e-3f);
        if (i > 0) {
            EXPECT_GE(result.pixels[i], result.pixels[i - 3]) << greys[i];
            // 0.035 EV apart: the steepest part of a display curve moves by about 1 % of its range.
            EXPECT_LT(result.pixels[i] - result.pixels[i - 3], 0.012f) << "no step that could band";
        }
    }
    // The tone scale of ACES 1.0 puts 0.18 at about 10 of 100 nits, and white far below the ceiling.
    const Image marks = mapper.apply(pixels({0.18f, 0.18f, 0.18f, 1.0f, 1.0f, 1.0f}), pool_);
    EXPECT_NEAR(marks.pixels[0], srgb(0.10f), 0.02f);
    EXPECT_GT(marks.pixels[3], 0.75f);
    EXPECT_LT(marks.pixels[3], 0.90f);
}

TEST_F(ToneMap, TurnsEveryInputIntoAValueBetween0And1)
{
    const float inf = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const std::string view : {"ACES 1.0 SDR", "Un-tone-mapped"}) {
        const ToneMapper mapper(at_exposure(10.0f, view));
        const Image result = mapper.apply(
            pixels({inf, inf, inf, nan, 0.5f, 0.5f, 1e30f, 1e30f, 1e30f, -inf, -1.0f, 0.0f, 5.0f, 0.0f, 0.0f}), pool_);
        for (const float v : result.pixels) {
            EXPECT_GE(v, 0.0f);
            EXPECT_LE(v, 1.0f);
        }
        EXPECT_GT(result.pixels[0], 0.95f) << "the brightest is white, not black";
        EXPECT_GT(result.pixels[6], 0.95f);
    }
}

TEST_F(ToneMap, ExposureScalesByPowersOfTwo)
{
    const Image two_stops_up = ToneMapper(at_exposure(2.0f)).apply(pixels({0.1f, 0.05f, 0.02f}), pool_);
    const Image four_times = ToneMapper(at_exposure(0.0f)).apply(pixels({0.4f, 0.2f, 0.08f}), pool_);
    EXPECT_EQ(two_stops_up.pixels, four_times.pixels) << "a power of two is exact";
    std::string message;
    EXPECT_EQ(code_of([] { ToneMapper mapper(at_exposure(std::nanf(""))); }, message), ErrorCode::bad_argument);
    EXPECT_EQ(code_of([] { ToneMapper mapper(at_exposure(1000.0f)); }, message), ErrorCode::bad_argument);
    EXPECT_NE(message.find("exposure"), std::string::npos);
}

TEST_F(ToneMap, AutomaticExposureBringsTheLogAverageToMiddleGrey)
{
    // exp(mean log) of 0.09 and 0.36 is 0.18; black and broken pixels have no say.
    EXPECT_NEAR(automatic_exposure(pixels({0.09f, 0.09f, 0.09f, 0.36f, 0.36f, 0.36f})), 0.0f, 1e-5f);
    EXPECT_NEAR(automatic_exposure(pixels({0.045f, 0.045f, 0.045f, 0.0f, 0.0f, 0.0f})), 2.0f, 1e-5f);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NEAR(automatic_exposure(pixels({0.72f, 0.72f, 0.72f, nan, 1.0f, 1.0f})), -2.0f, 1e-5f);
    EXPECT_EQ(automatic_exposure(pixels({0.0f, 0.0f, 0.0f})), 0.0f);

    const Image dim = pixels({0.01f, 0.02f, 0.03f, 0.04f, 0.05f, 0.06f});
    EXPECT_EQ(ToneMapper(ToneMapOptions{}).exposure(dim), automatic_exposure(dim));
    EXPECT_EQ(ToneMapper(at_exposure(1.5f)).exposure(dim), 1.5f);
}

TEST_F(ToneMap, GivesTheSameBitsForAnyNumberOfThreads)
{
    Image image(61, 47, 4);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        image.pixels[i] = static_cast<float>((i * 7919) % 1009) / 300.0f;
    }
    const ToneMapper mapper(at_exposure(0.0f));
    ThreadPool one(1), three(3);
    const Image a = mapper.apply(image, one);
    EXPECT_EQ(a.channels, 3);
    EXPECT_EQ(a.pixels, mapper.apply(image, three).pixels);
    // Nor does a pixel depend on its neighbours in the row.
    const Image alone = mapper.apply(pixels({image.at(60, 46)[0], image.at(60, 46)[1], image.at(60, 46)[2]}), one);
    EXPECT_EQ(alone.pixels[0], a.at(60, 46)[0]);
}

TEST_F(ToneMap, NamesThatDoNotExistAreErrorsThatListThoseThatDo)
{
    std::string message;
    ToneMapOptions options;
    options.view = "Filmic";
    EXPECT_EQ(code_of([&] { ToneMapper mapper(options); }, message), ErrorCode::not_found);
    EXPECT_NE(message.find("Filmic"), std::string::npos) << message;
    EXPECT_NE(message.find("ACES 1.0 SDR"), std::string::npos) << message;
    options = {};
    options.display = "Wall";
    EXPECT_EQ(code_of([&] { ToneMapper mapper(options); }, message), ErrorCode::not_found);
    EXPECT_NE(message.find("Wall"), std::string::npos) << message;
    EXPECT_NE(message.find("sRGB"), std::string::npos) << message;
}

/// A configuration with one view that halves all values.
const char* const kHalvingConfig = R"(ocio_profile_version: 2
search_path: ""
roles: {default: lin_rec709, scene_linear: lin_rec709}
displays:
  Wall: [!<View> {name: Half, colorspace: half}]
active_displays: []
active_views: []
colorspaces:
  - !<ColorSpace> {name: lin_rec709}
  - !<ColorSpace>
    name: half
    from_scene_reference: !<MatrixTransform> {matrix: [0.5,0,0,0, 0,0.5,0,0, 0,0,0.5,0, 0,0,0,1]}
)";

TEST_F(ToneMap, TakesAConfigurationFileAndTheEnvironmentVariable)
{
    const TemporaryFolder folder;
    test::write_bytes(folder / "half.ocio", kHalvingConfig);
    ToneMapOptions options = at_exposure(0.0f);
    options.ocio_config = folder / "half.ocio";
    const ToneMapper named(options);
    EXPECT_EQ(named.config_name(), folder / "half.ocio");
    EXPECT_EQ(named.display(), "Wall");
    EXPECT_EQ(named.view(), "Half");
    EXPECT_EQ(named.apply(pixels({0.5f, 1.0f, 0.25f}), pool_).pixels, (std::vector<float>{0.25f, 0.5f, 0.125f}));

    ::setenv("OCIO", (folder / "half.ocio").c_str(), 1);
    EXPECT_EQ(ToneMapper(at_exposure(0.0f)).view(), "Half");
    ::setenv("OCIO", "", 1);
    EXPECT_EQ(ToneMapper(at_exposure(0.0f)).config_name(), "built-in");
}

TEST_F(ToneMap, ConfigurationsThatAreMissingOrBrokenAreErrors)
{
    const TemporaryFolder folder;
    std::string message;
    ToneMapOptions options;
    options.ocio_config = folder / "missing.ocio";
    EXPECT_EQ(code_of([&] { ToneMapper mapper(options); }, message), ErrorCode::not_found);
    EXPECT_NE(message.find("missing.ocio"), std::string::npos) << message;

    test::write_bytes(folder / "broken.ocio", "ocio_profile_version: 2\n  nonsense [\n");
    options.ocio_config = folder / "broken.ocio";
    EXPECT_EQ(code_of([&] { ToneMapper mapper(options); }, message), ErrorCode::bad_file);
    EXPECT_NE(message.find("broken.ocio"), std::string::npos) << message;

    ::setenv("OCIO", (folder / "gone.ocio").c_str(), 1);
    EXPECT_EQ(code_of([] { ToneMapper mapper(ToneMapOptions{}); }, message), ErrorCode::not_found);
    EXPECT_NE(message.find("$OCIO"), std::string::npos) << message;
}

TEST_F(ToneMap, RefusesAnImageWithoutColours)
{
    std::string message;
    const ToneMapper mapper(at_exposure(0.0f));
    EXPECT_EQ(code_of([&] { mapper.apply(Image(2, 2, 1), pool_); }, message), ErrorCode::bad_argument);
    EXPECT_EQ(code_of([&] { automatic_exposure(Image(2, 2, 1)); }, message), ErrorCode::bad_argument);
}

}  // namespace
}  // namespace rcs
