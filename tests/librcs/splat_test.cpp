#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/gl_context.h"
#include "rcs/splat.h"
#include "rcs/thread_pool.h"
#include "splat/at_pixels.h"
#include "splat/tiles.h"
#include "stability/splat_oracle.h"
#include "support/splat_wall.h"

namespace rcs {
namespace {

using stability::double_loop;
using stability::largest_difference;

using Splat = test::SplatWall;

TEST_F(Splat, TilesAgreeWithAPlainDoubleLoop)
{
    const SplatBuffer tiles = splat_tiles(records, gbuffer, view, options, pool, stats);
    EXPECT_LT(largest_difference(tiles, double_loop(records, gbuffer, options), kBrightest), 1e-4);
    EXPECT_GT(stats.splats, 300u);
}

TEST_F(Splat, QuadsAgreeWithAPlainDoubleLoop)
{
    GlContext gl;
    const SplatBuffer quads = splat_quads(gl, records, gbuffer, view, options, pool, stats);
    EXPECT_LT(largest_difference(quads, double_loop(records, gbuffer, options), kBrightest), 1e-4);
}

TEST_F(Splat, QuadsAndTilesCountTheSameRecords)
{
    GlContext gl;
    const SplatBuffer quads = splat_quads(gl, records, gbuffer, view, options, pool, stats);
    const SplatBuffer tiles = splat_tiles(records, gbuffer, view, options, pool, stats);
    std::size_t different = 0;
    for (std::size_t i = 0; i < gbuffer.size(); ++i)
        different += std::abs(quads.count[i] - tiles.count[i]) > 0.5f ? 1 : 0;
    // A record may end between two pixels' roundings of the same weight, nowhere else.
    EXPECT_LE(different, gbuffer.size() / 1000);
}

TEST_F(Splat, WeightsAloneAreTheSameBits)
{
    const SplatBuffer tiles = splat_tiles(records, gbuffer, view, options, pool, stats);
    std::vector<float> weight(gbuffer.size(), 0.0f);
    add_weights(records, make_tiled_surfaces(gbuffer, pool), view, options, pool, weight);
    EXPECT_EQ(weight, tiles.weight);
}

TEST_F(Splat, SomePixelsHaveTheBitsOfTheWholeImage)
{
    const SplatBuffer all = splat_tiles(records, gbuffer, view, options, pool, stats);
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t i = 0; i < gbuffer.size(); ++i)
        pixels.push_back(i * 7919u % static_cast<std::uint32_t>(gbuffer.size()));
    // More of one place than a tile holds.
    pixels.insert(pixels.end(), TiledSurfaces::kTilePixels + 9, 500u);
    const PixelSums some = splat_at_pixels(records, gbuffer, pixels, view, options, pool);
    const PixelSums few = splat_at_pixels(records, gbuffer, std::span(pixels).first(40), view, options, pool);
    EXPECT_EQ(some.luminance_unit, all.luminance_unit);
    std::size_t lit = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const std::uint32_t p = pixels[i];
        ASSERT_EQ(some.squares[i], all.squares[p]) << p;
        ASSERT_EQ(some.variance[i], all.variance[p]) << p;
        ASSERT_EQ(some.variance_of_sum[i], all.variance_of_sum[p]) << p;
        ASSERT_EQ(some.weight[i], all.weight[p]) << p;
        ASSERT_EQ(some.weighted[i], glm::vec3(all.weighted_r[p], all.weighted_g[p], all.weighted_b[p])) << p;
        if (i < 40) {
            ASSERT_EQ(few.weighted[i], some.weighted[i]) << p;
        }
        lit += all.weight[p] > 0.0f ? 1 : 0;
    }
    EXPECT_GT(lit, pixels.size() / 4);
    SplatSettings plain = options;
    plain.error_sums = false;
    const PixelSums light = splat_at_pixels(records, gbuffer, pixels, view, plain, pool);
    EXPECT_EQ(light.weighted, some.weighted);
    EXPECT_TRUE(light.squares.empty());
}

TEST_F(Splat, ThreadsDoNotChangeABit)
{
    ThreadPool one(1), three(3);
    const SplatBuffer a = splat_tiles(records, gbuffer, view, options, one, stats);
    const SplatBuffer b = splat_tiles(records, gbuffer, view, options, three, stats);
    EXPECT_EQ(a.weighted_r, b.weighted_r);
    EXPECT_EQ(a.weight, b.weight);
}

TEST_F(Splat, NothingLandsWhereNothingIsSeen)
{
    const SplatBuffer tiles = splat_tiles(records, gbuffer, view, options, pool, stats);
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        if (!gbuffer.covered(i)) {
            EXPECT_EQ(tiles.weight[i], 0.0f);
        }
    }
}

TEST_F(Splat, TheWeightIsOneAtTheRecordAndZeroAtTheRim)
{
    const glm::vec3 p = gbuffer.scene_position(500);
    Record r = records[1];
    r.position = p;
    r.normal = gbuffer.normal(500);
    r.spacing_radius = 1.0f;
    const SplatBuffer at = splat_tiles({r}, gbuffer, view, {0.3f, 1.0f}, pool, stats);
    // The position is rounded to scene-space floats of about 100 m: 8 micrometres of a metre's radius.
    EXPECT_NEAR(at.weight[500], 1.0f, 1e-3f);
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        if (gbuffer.covered(i) && glm::distance(gbuffer.scene_position(i), p) > 1.0001f) {
            EXPECT_EQ(at.weight[i], 0.0f);
        }
    }
}

}  // namespace
}  // namespace rcs
