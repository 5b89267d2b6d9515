#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "accuracy/error_estimate.h"
#include "placement/holes.h"
#include "placement/placement.h"
#include "rcs/error.h"
#include "rcs/gbuffer.h"
#include "rcs/gl_context.h"
#include "rcs/records.h"
#include "rcs/render.h"
#include "records/known_record.h"
#include "support/same_bits.h"
#include "support/scenes.h"
#include "support/session.h"

namespace rcs {
namespace {

/// A room with a box and a lamp, as one view sees it.
class PlaceRecords : public testing::Test {
protected:
    Scene scene = test::furnished_room();
    ThreadPool pool{2};
    RayScene rays = build_ray_scene(scene, pool);
    View view = test::view_of(scene.cameras[0], 120, 90);
    GlContext gl;
    GBuffer gbuffer = render_gbuffer(gl, rays, view, 1.0f, pool);
    RecordStats stats;

    std::vector<Record> place(const RecordSettings& options, int threads = 2, std::vector<Record> records = {})
    {
        ThreadPool own(threads);
        place_records(rays, gbuffer, view, options, own, records, stats);
        return records;
    }

    /// Visible pixels that no record reaches with its spacing radius: Ward's measure with the distance across the
    /// tangent plane doubled (shaders/shared/weight.h), in double precision.
    int unserved(const std::vector<Record>& records, double tolerance)
    {
        int count = 0;
        for (std::size_t i = 0; i < gbuffer.size(); ++i) {
            if (!gbuffer.covered(i)) continue;
            const glm::dvec3 p = gbuffer.camera_position + glm::dvec3(gbuffer.position(i));
            double least = std::numeric_limits<double>::infinity();
            for (const Record& r : records) {
                const glm::dvec3 d = p - glm::dvec3(r.position), n(r.normal);
                const double across = glm::dot(d, n);
                const double turned = std::max(0.0, 1.0 - glm::dot(n, glm::dvec3(gbuffer.normal(i))));
                least = std::min(
                    least, std::sqrt(glm::dot(d, d) + 3.0 * across * across) / static_cast<double>(r.spacing_radius) +
                               std::sqrt(turned) / tolerance);
            }
            count += least < 1.0 + 1e-4 ? 0 : 1;  // the rim itself is a matter of float rounding
        }
        return count;
    }
};

using test::same_bits;

TEST_F(PlaceRecords, LeavesNoVisiblePointUnserved)
{
    for (const float tolerance : {0.1f, 0.2f, 0.5f}) {
        RecordSettings options;
        options.error_tolerance = tolerance;
        options.rays = 64;
        EXPECT_EQ(unserved(place(options), static_cast<double>(tolerance)), 0) << tolerance;
    }
}

TEST_F(PlaceRecords, NeedsFewRecordsAndMoreOfThemForLessError)
{
    RecordSettings options;
    options.rays = 64;
    std::size_t last = 0;
    for (const float tolerance : {1.0f, 0.4f, 0.2f, 0.1f}) {
        options.error_tolerance = tolerance;
        const std::size_t count = place(options).size();
        EXPECT_GT(count, last);
        last = count;
        // The closest spacing is a x min_reach pixels: discs of half that radius around the records do not
        // overlap. Creases, where normals part, and records of one wave may double that.
        const double spacing = std::max(1.0, static_cast<double>(tolerance * options.min_reach));
        EXPECT_LT(static_cast<double>(count), 2.0 * static_cast<double>(gbuffer.size()) / (0.785 * spacing * spacing));
    }
    EXPECT_LE(last, gbuffer.size());
}

TEST_F(PlaceRecords, LooksForHolesInEveryPixelOnce)
{
    // Of windows of a picture, too, that begin anywhere.
    const std::vector<float> served(gbuffer.size(), 0.0f);
    const auto covered = static_cast<std::size_t>(std::count_if(gbuffer.instance.begin(), gbuffer.instance.end(),
                                                                [](std::uint32_t i) { return i != GBuffer::kNone; }));
    for (const glm::ivec2 corner : {glm::ivec2(0), glm::ivec2(32, 64), glm::ivec2(33, 64), glm::ivec2(34, 67)}) {
        for (const int stride : {2, 1}) {
            std::vector<std::uint32_t> all = find_holes(gbuffer, corner, served, {stride, -1, false}, 1, pool), parts;
            for (int phase = 0; phase < 4; ++phase) {
                const auto some = find_holes(gbuffer, corner, served, {stride, phase, false}, 1, pool);
                EXPECT_GT(some.size(), all.size() / 5);
                parts.insert(parts.end(), some.begin(), some.end());
            }
            std::sort(all.begin(), all.end());
            std::sort(parts.begin(), parts.end());
            EXPECT_EQ(parts, all);
            if (stride == 1) {
                EXPECT_EQ(all.size(), covered);
            }
        }
    }
}

TEST_F(PlaceRecords, MakesEachRecordAtAVisiblePointAndCountsIt)
{
    RecordSettings options;
    options.rays = 64;
    const std::vector<Record> records = place(options);
    EXPECT_EQ(stats.records, records.size());
    EXPECT_GE(stats.hemisphere_rays, 32 * records.size());
    EXPECT_GT(stats.shadow_rays, 0u);
    EXPECT_GE(stats.waves, 1u);
    for (const Record& r : records) {
        bool found = false;
        for (std::size_t i = 0; i < gbuffer.size() && !found; ++i)
            found = gbuffer.covered(i) && glm::distance(gbuffer.scene_position(i), r.position) < 1e-5f &&
                    glm::distance(gbuffer.normal(i), r.normal) < 1e-5f && gbuffer.footprint[i] == r.footprint;
        ASSERT_TRUE(found);
        ASSERT_GT(r.spacing_radius, 0.0f);
        ASSERT_LE(r.spacing_radius, options.error_tolerance * options.max_reach * r.footprint * 1.0001f);
        const float least = std::min(options.steepest * options.min_reach, kLeastReach);
        ASSERT_GE(r.spacing_radius, options.error_tolerance * least * r.footprint * 0.9999f);
        ASSERT_GE(std::min({r.irradiance.r, r.irradiance.g, r.irradiance.b}), 0.0f);
    }
}

TEST_F(PlaceRecords, GivesTheSameBitsForAnyNumberOfThreads)
{
    RecordSettings options;
    options.rays = 100;
    const std::vector<Record> one = place(options, 1);
    EXPECT_TRUE(same_bits(one, place(options, 2)));
    EXPECT_TRUE(same_bits(one, place(options, 3)));
    EXPECT_TRUE(same_bits(one, place(options, 2))) << "a second run";
}

TEST_F(PlaceRecords, ASeedIsAnotherSetOfRecords)
{
    RecordSettings options;
    options.rays = 64;
    const std::vector<Record> first = place(options);
    options.seed = 2;
    EXPECT_FALSE(same_bits(first, place(options)));
}

TEST_F(PlaceRecords, AddsNothingWhereTheCacheServesAll)
{
    RecordSettings options;
    options.rays = 64;
    const std::vector<Record> first = place(options);
    stats = {};
    EXPECT_TRUE(same_bits(place(options, 2, first), first));
    EXPECT_EQ(stats.records, 0u);
    EXPECT_EQ(stats.hemisphere_rays, 0u);
}

TEST_F(PlaceRecords, KeepsTheCacheInFrontAndFillsTheRest)
{
    RecordSettings options;
    options.rays = 64;
    std::vector<Record> half = place(options);
    half.resize(half.size() / 2);
    const std::vector<Record> filled = place(options, 2, half);
    ASSERT_GT(filled.size(), half.size());
    for (std::size_t k = 0; k < half.size(); ++k) ASSERT_EQ(filled[k].position, half[k].position);
    EXPECT_EQ(unserved(filled, static_cast<double>(options.error_tolerance)), 0);
}

/// More rays may find light steeper than those that set the spacing: one that met a wall at once made a spot of light
/// 600 times as bright as its wall.
TEST_F(PlaceRecords, ExtrapolateToTwiceTheirLightAtTheMostHoweverManyRaysTheyGot)
{
    const RecordSettings options{.rays = 16, .noise_target = 0.002f, .refinement = 64};
    std::size_t refined = 0;
    for (const Record& r : place(options)) {
        const float reach = r.spacing_radius / options.error_tolerance;
        ASSERT_LE(r.gradient_scale * reach, 1.0001f * gradient_reach(r)) << "after " << r.rays << " rays";
        refined += r.rays > 32 ? 1 : 0;
    }
    EXPECT_GT(refined, 100u);
}

TEST_F(PlaceRecords, StopsWhenAsked)
{
    std::vector<Record> records;
    int calls = 0;
    try {
        place_records(rays, gbuffer, view, {}, pool, records, stats, [&](std::string_view stage, float fraction) {
            EXPECT_EQ(stage, "records");
            EXPECT_TRUE(fraction >= 0.0f && fraction <= 1.0f);
            return ++calls < 2;
        });
        FAIL() << "went on";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::cancelled);
    }
    EXPECT_EQ(calls, 2);
}

TEST(ValidateRecordOptions, NamesTheFieldItsValueAndItsRange)
{
    const auto message = [](auto change) -> std::string {
        RecordSettings options;
        change(options);
        try {
            validate(options);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::bad_argument);
            return e.what();
        }
        return "no error";
    };
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(message([](RecordSettings&) {}), "no error");
    for (const float a : {0.0f, -1.0f, 1.5f, nan})
        EXPECT_NE(message([a](RecordSettings& o) { o.error_tolerance = a; }).find("error_tolerance is"),
                  std::string::npos)
            << a;
    for (const int n : {15, -1, 65537})
        EXPECT_NE(message([n](RecordSettings& o) { o.rays = n; }).find("rays is " + std::to_string(n)),
                  std::string::npos);
    for (const float r : {0.0f, 101.0f, nan})
        EXPECT_NE(message([r](RecordSettings& o) { o.min_reach = r; }).find("min_reach is"), std::string::npos) << r;
    for (const float r : {0.0f, -2.0f, nan, std::numeric_limits<float>::infinity()})
        EXPECT_NE(message([r](RecordSettings& o) { o.max_reach = r; }).find("max_reach is"), std::string::npos) << r;
    for (const float g : {0.0f, -3.0f, nan})
        EXPECT_NE(message([g](RecordSettings& o) { o.gradient_limit = g; }).find("gradient_limit is"),
                  std::string::npos)
            << g;
    for (const int b : {-1, 65, 700})
        EXPECT_NE(message([b](RecordSettings& o) { o.bounces = b; }).find("bounces is"), std::string::npos) << b;
}

/// Mean over the picture of what the records' extrapolations differ by, relative to their light.
double spread_of(const std::vector<Record>& records, const GBuffer& gbuffer, const View& view, float error_tolerance,
                 ThreadPool& pool)
{
    SplatStats stats;
    const SplatBuffer sums =
        splat_tiles(records, make_tiled_surfaces(gbuffer, pool), view, {error_tolerance, 3.0f}, pool, stats);
    const ErrorMap map = error_map(sums, stats, 3.0f, pool);
    double sum = 0.0;
    for (const float spread : map.spread) sum += static_cast<double>(spread) / static_cast<double>(gbuffer.size());
    return sum;
}

TEST(PlaceRecordsOfARoom, LieCloserWhereTheirExtrapolationsDisagree)
{
    const Scene scene = load_scene("demo:ajar");
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const View view = test::view_of(scene.cameras[0], 240, 160);
    GlContext gl;
    const GBuffer gbuffer = render_gbuffer(gl, rays, view, 1.0f, pool);
    RecordSettings options;
    options.rays = 512;  // little noise, behind which spread hides
    const auto place = [&](bool sharpened, double& spread) {
        std::vector<Record> records;
        RecordStats stats;
        Placement placement({rays}, gbuffer, view, options, pool, records, stats, [](float) {});
        placement.fill();
        if (sharpened) placement.sharpen();
        spread = spread_of(records, gbuffer, view, options.error_tolerance, pool);
        return records;
    };
    double wide = 0.0, close = 0.0;
    const std::size_t before = place(false, wide).size();
    const std::vector<Record> after = place(true, close);
    EXPECT_LT(close, 0.85 * wide);
    EXPECT_GT(after.size(), before + before / 20);
    EXPECT_LT(after.size(), 2 * before);
    for (const Record& r : after)
        EXPECT_GE(r.spacing_radius, 0.999f * options.error_tolerance * kLeastReach * r.footprint);
}

TEST_F(PlaceRecords, LieAsCloseAsThoseOfAnotherViewThatTheyAreFewBeside)
{
    std::vector<Record> records = place({});
    const std::size_t known = records.size();
    for (std::size_t k = known / 2; k < known / 2 + 3; ++k) records[k] = records[0];
    records = place({}, 2, records);
    EXPECT_LT(records.size(), known + known / 10);
}

/// Of a wall that the eye is in the plane of, pixels may see a point that has no size: no record serves it.
TEST(PlaceRecordsOfARoom, EndWhereTheEyeIsInThePlaneOfAWall)
{
    Scene scene = test::furnished_room();
    const int both = test::add_material(scene, glm::vec3(0.6f), glm::vec3(0.0f), true);
    for (const float up : {1.0f, -1.0f})
        test::add_mesh(scene,
                       test::quad({1.0f, 1.5f - 1.5f * up, -2.0f}, {0.0f, 0.0f, 3.9f}, {0.0f, 2.9f * up, 0.0f}, both));
    for (const double z : {1.4, 0.0}) {
        const Camera camera = look_at_camera("in the wall", {1.0, 1.0, z}, {1.0, 1.0, -2.0}, 0.8);
        const RenderResult result = test::render_view(scene, camera, test::options_of_size(64, 36, 1));
        EXPECT_LT(result.stats.records.records, 64u * 36u);
        for (const float value : result.image.layers.at("beauty").pixels) EXPECT_TRUE(std::isfinite(value));
    }
}

}  // namespace
}  // namespace rcs
