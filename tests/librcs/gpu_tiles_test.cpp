// Splats by tiles in compute shaders, against a plain double loop, the processor's tiles and quads.
#include "splat/gpu_tiles.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <epoxy/gl.h>

#include "gl/gl_context_impl.h"
#include "rcs/machine.h"
#include "rcs/scene_choice.h"
#include "splat/splat_choice.h"
#include "stability/splat_oracle.h"
#include "support/session.h"
#include "support/splat_wall.h"
#include "support/temporary_folder.h"

namespace rcs {
namespace {

using stability::double_loop;
using stability::largest_difference;
using stability::random_records;
using stability::wavy_wall;

class GpuTiles : public test::SplatWall {
protected:
    GlContext& gl = test::shared_gl();

    SplatBuffer splat(const std::vector<Record>& from, const Shading* glossy = nullptr)
    {
        return splat_gpu_tiles(gl, from, gbuffer, view, options, pool, stats, glossy);
    }
};

using Plane = std::vector<float>;

void expect_near(const Plane& got, const Plane& expected, const std::string& name)
{
    ASSERT_EQ(got.size(), expected.size()) << name;
    // What quads and tiles may differ by, of the most there is at a pixel.
    float most = 0.0f, worst = 0.0f;
    for (std::size_t i = 0; i < got.size(); ++i) {
        most = std::max(most, std::abs(expected[i]));
        worst = std::max(worst, std::abs(got[i] - expected[i]));
    }
    EXPECT_LE(worst, 1e-4f * most) << name;
}

void expect_near(const SplatBuffer& got, const SplatBuffer& expected)
{
    EXPECT_EQ(got.width, expected.width);
    EXPECT_EQ(got.height, expected.height);
    EXPECT_EQ(got.luminance_unit, expected.luminance_unit);
    expect_near(got.weighted_r, expected.weighted_r, "red");
    expect_near(got.weighted_g, expected.weighted_g, "green");
    expect_near(got.weighted_b, expected.weighted_b, "blue");
    expect_near(got.weight, expected.weight, "weight");
    expect_near(got.squares, expected.squares, "squares");
    expect_near(got.variance, expected.variance, "variance");
    expect_near(got.variance_of_sum, expected.variance_of_sum, "variance of the sum");
    expect_near(got.glossy_r, expected.glossy_r, "glossy red");
    expect_near(got.glossy_g, expected.glossy_g, "glossy green");
    expect_near(got.glossy_b, expected.glossy_b, "glossy blue");
    // A record may end between two roundings of the same weight, nowhere else.
    std::size_t different = 0;
    for (std::size_t i = 0; i < got.count.size(); ++i) different += got.count[i] != expected.count[i];
    EXPECT_LE(different, got.count.size() / 1000);
}

void expect_same_bits(const SplatBuffer& a, const SplatBuffer& b, const std::string& words = {})
{
    const auto planes = [](const SplatBuffer& s) {
        return std::vector{s.weighted_r, s.weighted_g, s.weighted_b,      s.weight,   s.count,   s.squares,
                           s.variance,   s.glossy_r,   s.variance_of_sum, s.glossy_g, s.glossy_b};
    };
    const std::vector<Plane> of_a = planes(a), of_b = planes(b);
    for (std::size_t n = 0; n < of_a.size(); ++n) {
        ASSERT_EQ(of_a[n].size(), of_b[n].size());
        std::size_t different = 0, at = 0;
        for (std::size_t i = 0; i < of_a[n].size(); ++i)
            if (of_a[n][i] != of_b[n][i]) ++different, at = i;
        EXPECT_EQ(different, 0u) << words << ", plane " << n << ", as at " << at << ": " << of_a[n][at] << " and "
                                 << of_b[n][at];
    }
}

TEST_F(GpuTiles, AgreeWithAPlainDoubleLoop)
{
    EXPECT_LT(largest_difference(splat(records), double_loop(records, gbuffer, options), kBrightest), 1e-4);
    EXPECT_GT(stats.splats, 300u);
}

TEST_F(GpuTiles, GiveTheSumsOfTilesAndOfQuads)
{
    SplatStats of_tiles, of_quads;
    const SplatBuffer got = splat(records);
    expect_near(got, splat_tiles(records, gbuffer, view, options, pool, of_tiles));
    expect_near(got, splat_quads(gl, records, gbuffer, view, options, pool, of_quads));
    EXPECT_EQ(stats.splats, of_tiles.splats);
    EXPECT_EQ(stats.samples, of_tiles.samples);
}

TEST_F(GpuTiles, LightGlossySurfacesAsTilesDo)
{
    const Shading shading = test::make_glossy(gbuffer, records);
    for (const bool with_errors : {true, false}) {
        options.error_sums = with_errors;
        SplatStats ignored;
        const SplatBuffer got = splat(records, &shading);
        expect_near(got, splat_tiles(records, gbuffer, view, options, pool, ignored, &shading));
        EXPECT_EQ(got.squares.empty(), !with_errors);
        EXPECT_GT(*std::max_element(got.glossy_g.begin(), got.glossy_g.end()), 0.0f);
    }
}

TEST_F(GpuTiles, LightGlossySurfacesOfAParallelCameraAsTilesDo)
{
    view.camera.projection = Projection::orthographic;
    gbuffer = wavy_wall(view, kEye);
    records = random_records(gbuffer, 400, 7);
    const Shading shading = test::make_glossy(gbuffer, records);
    SplatStats ignored;
    const SplatBuffer got = splat(records, &shading);
    expect_near(got, splat_tiles(records, gbuffer, view, options, pool, ignored, &shading));
    EXPECT_GT(*std::max_element(got.glossy_g.begin(), got.glossy_g.end()), 0.0f);
}

TEST_F(GpuTiles, AreTheSameBitsEachTimeAndInHoweverManyParts)
{
    const Shading shading = test::make_glossy(gbuffer, records);
    for (const Shading* glossy : {static_cast<const Shading*>(nullptr), &shading}) {
        const SplatBuffer first = splat(records, glossy);
        expect_same_bits(first, splat(records, glossy));
        // Blocks of few records, and of fewer pairs of records and tiles; with lobes bands of rows as well, which end
        // within tiles.
        for (const std::size_t bytes : {std::size_t{3000}, std::size_t{100000}, std::size_t{1} << 20})
            expect_same_bits(first, splat_gpu_tiles({gl, pool, bytes}, records, gbuffer, view, options, stats, glossy),
                             std::to_string(bytes) + " bytes");
    }
}

TEST_F(GpuTiles, OfNoRecordAreZero)
{
    const SplatBuffer none = splat({});
    EXPECT_EQ(none.weight, Plane(gbuffer.size(), 0.0f));
    EXPECT_EQ(none.squares, Plane(gbuffer.size(), 0.0f));
    EXPECT_EQ(stats.splats, 0u);
}

TEST_F(GpuTiles, OfAPictureWithoutPixelsAreNone)
{
    EXPECT_EQ(splat_gpu_tiles(gl, records, {}, {}, {}, pool, stats).width, 0);
}

TEST_F(GpuTiles, ARecordThatCoversAllReachesWhatIsSeen)
{
    Record record = records[0];
    record.position = glm::vec3(kEye);
    record.spacing_radius = 100.0f;
    options.error_tolerance = 10.0f;  // whatever the normal
    const SplatBuffer sums = splat({record});
    for (std::size_t i = 0; i < gbuffer.size(); ++i)
        ASSERT_EQ(sums.count[i], gbuffer.covered(i) ? 1.0f : 0.0f) << "pixel " << i;
    // Over all tiles, and more of them in each than a block holds at a time.
    const std::vector<Record> many(1500, record);
    const SplatBuffer summed = splat_gpu_tiles({gl, pool, 1u << 16}, many, gbuffer, view, options, stats, nullptr);
    for (std::size_t i = 0; i < gbuffer.size(); ++i)
        ASSERT_EQ(summed.count[i], gbuffer.covered(i) ? 1500.0f : 0.0f) << "pixel " << i;
    expect_same_bits(summed, splat(many));
}

TEST_F(GpuTiles, MoreRecordsInATileThanALoopOfAShaderMayHaveRoundsAreAllCounted)
{
    view.width = view.height = 3;
    gbuffer = wavy_wall(view, kEye);
    ASSERT_TRUE(gbuffer.covered(4));
    Record record = records[0];
    record.position = gbuffer.scene_position(4);
    record.normal = gbuffer.normal(4);
    EXPECT_EQ(splat(std::vector<Record>(70000, record)).count[4], 70000.0f);
}

TEST_F(GpuTiles, OfAPictureSmallerThanATileAreThoseOfTiles)
{
    view.width = 3, view.height = 2;
    gbuffer = wavy_wall(view, kEye);
    records = random_records(gbuffer, 40, 9);
    SplatStats ignored;
    expect_near(splat(records), splat_tiles(records, gbuffer, view, options, pool, ignored));
}

// 4.5 million pixels need two bands; one record surrounds the camera and so reaches both.
TEST_F(GpuTiles, OfALargeImageHaveNoSeamBetweenTheirBands)
{
    view.width = 3000, view.height = 1500;
    gbuffer = wavy_wall(view, kEye);
    Record record;
    record.position = glm::vec3(kEye);
    record.normal = {0.0f, 0.0f, 1.0f};
    record.irradiance = glm::vec3(1.0f);
    record.spacing_radius = 100.0f;
    options = {.error_tolerance = 1.0f, .error_sums = false};
    const SplatBuffer sums = splat({record}), of_tiles = splat_tiles({record}, gbuffer, view, options, pool, stats);
    EXPECT_GT(std::count(sums.count.begin(), sums.count.end(), 1.0f), 1000000);
    expect_near(sums, of_tiles);
}

RenderOptions options_with(SplatMethod method)
{
    RenderOptions options = test::options_of_size(75, 50, 2);
    options.splat = method;
    options.gather = GatherMethod::processor;  // automatic may differ from one number of threads to another
    return options;
}

TEST(GpuTilesRender, PicturesAgreeAndAreTheSameBitsEachTimeWithRaysOnTheDeviceToo)
{
    for (const char* name : {"demo:cornell", "demo:spheres"}) {
        const Scene scene = load_scene(name);
        RenderOptions options = options_with(SplatMethod::gpu_tiles);
        options.gather = GatherMethod::device;
        const RenderResult got = test::render_first(scene, options);
        const RenderResult again = test::render_first(scene, options, 1);
        options.splat = SplatMethod::tiles;
        const RenderResult tiles = test::render_first(scene, options);
        EXPECT_EQ(got.stats.splat_method, "gpu-tiles");
        EXPECT_EQ(got.stats.gather_method, "gpu");
        EXPECT_EQ(got.image.metadata.at("rcs:splat"), "gpu-tiles");
        ASSERT_EQ(got.records.size(), tiles.records.size());
        for (const auto& [layer, image] : got.image.layers)
            EXPECT_EQ(image.pixels, again.image.layers.at(layer).pixels) << name << ", layer " << layer;
        expect_near(got.image.layers.at("beauty").pixels, tiles.image.layers.at("beauty").pixels, name);
    }
}

/// Renders with a GL that reports an error at the next splat, as it does when it is lost or its memory is used up.
RenderResult render_with_fault(Session& session, SplatMethod method, std::vector<std::string>& warnings)
{
    RenderHooks hooks;
    hooks.log = [&](LogLevel level, std::string_view line) {
        if (level == LogLevel::warning) warnings.emplace_back(line);
    };
    bool done = false;
    hooks.progress = [&](std::string_view stage, float) {
        if (stage == "splat" && !done) {
            done = true;
            session.gl().impl().make_current();
            glEnable(0xdead);
        }
        return true;
    };
    return render(session, session.scene().cameras.at(0), options_with(method), hooks);
}

TEST(GpuTilesRender, WhereTheDeviceFailsTheProcessorGoesOnAndSaysSo)
{
    const RenderResult expected = test::render_first(load_scene("demo:cornell"), options_with(SplatMethod::tiles));
    for (const SplatMethod method : {SplatMethod::gpu_tiles, SplatMethod::quads}) {
        Session session;
        session.show(load_scene("demo:cornell"));
        std::vector<std::string> warnings;
        const RenderResult got = render_with_fault(session, method, warnings);
        EXPECT_EQ(got.stats.splat_method, "tiles");
        EXPECT_EQ(got.image.layers.at("beauty").pixels, expected.image.layers.at("beauty").pixels);
        EXPECT_EQ(got.stats.splats.splats, expected.stats.splats.splats);
        ASSERT_EQ(warnings.size(), 1u) << name_of(method);
        EXPECT_NE(warnings[0].find("the processor splats"), std::string::npos) << warnings[0];
        EXPECT_NE(warnings[0].find(session.gl().renderer()), std::string::npos) << warnings[0];
        // From here on, without asking again.
        const RenderResult next = render(session, session.scene().cameras.at(0), options_with(method));
        EXPECT_EQ(next.stats.splat_method, "tiles");
    }
}

TEST(GpuTilesRender, AutomaticIsTilesOnASoftwareGL)
{
    GlContext& gl = test::shared_gl();
    if (!gl.software()) GTEST_SKIP() << "a hardware GL";
    ThreadPool pool(2);
    const SplatChoice choice = choose_splat(gl, pool);
    EXPECT_EQ(choice.method, SplatMethod::tiles);
    EXPECT_NE(choice.why.find("software"), std::string::npos) << choice.why;
    EXPECT_EQ(describe_splat(gl, pool).at(0).second, choice.words());
    const RenderResult result = test::render_first(load_scene("demo:cornell"), options_with(SplatMethod::automatic));
    EXPECT_EQ(result.stats.splat_method, "tiles");
}

TEST(GpuTilesRender, AMeasurementIsKeptInTheCacheFolderAndDecides)
{
    const test::TemporaryFolder folder;
    ::setenv("XDG_CACHE_HOME", (folder / "cache").c_str(), 1);
    ThreadPool pool(2);
    GlContext& gl = test::shared_gl();
    const SplatChoice first = choose_splat(gl, pool, true), second = choose_splat(gl, pool, true);
    EXPECT_NE(first.why.find("measured now"), std::string::npos) << first.why;
    EXPECT_NE(second.why.find("measured before"), std::string::npos) << second.why;
    EXPECT_EQ(first.method, second.method);
    for (const char* way : {"quads ", "gpu-tiles ", "tiles "})
        EXPECT_NE(first.why.find(way), std::string::npos) << first.why;
    const std::string path = folder / "cache/rcsplat/splat";
    std::ifstream kept(path);
    std::string key;
    kept >> key;
    const auto chosen_of = [&](const std::string& speeds) {
        std::ofstream(path) << key << speeds << "\n";
        return choose_splat(gl, pool, true).method;
    };
    EXPECT_EQ(chosen_of(" 10.0 11.0 11.5"), SplatMethod::quads);  // by too little
    EXPECT_EQ(chosen_of(" 10.0 100.0 50.0"), SplatMethod::gpu_tiles);
    EXPECT_EQ(chosen_of(" 10.0 20.0 50.0"), SplatMethod::tiles);
    std::ofstream(path) << key << " 10.0 20.0\n";  // too few numbers
    EXPECT_NE(choose_splat(gl, pool, true).why.find("measured now"), std::string::npos);
    ::unsetenv("XDG_CACHE_HOME");
}

}  // namespace
}  // namespace rcs
