#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "facts/scene_effects.h"
#include "gbuffer/views.h"
#include "lit_points/lamp_guide.h"
#include "rcs/metrics.h"
#include "rcs/reference.h"
#include "records/lamps_to_gather.h"
#include "support/effect_scenes.h"
#include "support/place.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

struct Place : test::Place {
    explicit Place(Scene s) : test::Place(std::move(s), test::even_floor()) {}

    GatheredLamps lamps() { return lamps_to_gather(LitScene{rays}, points, RecordSettings{}, pool); }
};

TEST(LampsToGather, AreHugeOnesOfWhichLittleIsSeen)
{
    EXPECT_TRUE(Place(test::window_room(1.0f)).lamps().has(9));
    EXPECT_FALSE(Place(test::window_room(1.0f)).lamps().has(0));
    EXPECT_FALSE(Place(test::window_room(1.0f, 2.0f)).lamps().any()) << "small: its shadows are sharp";
    Scene open = test::window_room(1.0f);
    open.instances.erase(open.instances.begin() + 5, open.instances.begin() + 9);
    EXPECT_FALSE(Place(std::move(open)).lamps().any()) << "nothing hides it";
    EXPECT_FALSE(Place(test::lit_room()).lamps().any());
}

struct Mean {
    double light = 0.0, variance = 0.0;  // the latter of the mean
};

Mean mean_at(const Place& place, const HitRadiance& light, const SurfacePoint& p, int count, std::uint64_t seed)
{
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k < count; ++k) {
        RandomStream random(stream_key(seed, Stream::gather, static_cast<std::uint64_t>(k)));
        double found = 0.0;
        light.direct(p, random, [&](const Ray& ray, glm::vec3 white) {
            if (!occluded(place.rays, ray)) found += static_cast<double>(luminance(white));
        });
        sum += found;
        squares += found * found;
    }
    const double mean = sum / count;
    return {mean, (squares / count - mean * mean) / count};
}

/// At places where rays end: in the room, and close to the panel. Points on lamps are another matter of chance.
TEST(LampGuide, FindsTheLightThatSamplesFind)
{
    Place place(test::window_room(1.0f));
    const GatheredLamps lamps = place.lamps();
    ASSERT_TRUE(lamps.any());
    const EffectSet effects = scene_effects(place.rays);
    const HitRadiance plain(place.rays, nullptr, effects);
    constexpr int kGuides = 4, kMany = 1 << 17, kFew = 1 << 12;
    double noise_plain = 0.0, noise_guided = 0.0;
    struct Spot {
        glm::vec3 position, normal;
    };
    const Spot spots[] = {
        {{0, 0, 0}, {0, 1, 0}}, {{-1.5f, 0, 0.5f}, {0, 1, 0}}, {{-2, 1.5f, 0.3f}, {1, 0, 0}}, {{21, 0, 0}, {0, 1, 0}}};
    for (const auto& [at, normal] : spots) {
        SurfacePoint p{};
        p.position = at;
        p.geometric_normal = p.shading_normal = normal;
        p.position_error = 1e-5f;
        const Mean truth = mean_at(place, plain, p, kMany, 1);
        ASSERT_GT(truth.light, 0.0) << at.x;
        double mean = 0.0, square = 0.0;
        for (std::uint64_t seed = 0; seed < kGuides; ++seed) {
            GatheredLamps guided = lamps;
            const LampGuide guide(place.rays, effects, lamps, place.points, place.view, seed, place.pool);
            guided.finder = &guide;
            const Mean found = mean_at(place, HitRadiance(place.rays, nullptr, effects, &guided), p, kFew, seed + 2);
            mean += found.light / kGuides;
            square += found.light * found.light / kGuides;
            if (at.x < 2.0f) noise_guided += found.variance * kFew / (truth.light * truth.light) / kGuides;
        }
        const double error = std::sqrt(truth.variance + (square - mean * mean) / kGuides);
        EXPECT_NEAR(mean, truth.light, 4.0 * error) << at.x;
        EXPECT_LT(error, 0.08 * truth.light) << at.x;
        if (at.x < 2.0f) noise_plain += truth.variance * kMany / (truth.light * truth.light);
    }
    EXPECT_LT(noise_guided, 0.25 * noise_plain) << "the places in the room";
}

class GatheredLampsRender : public testing::TestWithParam<float> {};

/// The light falls into the layers that the path tracer has it in.
TEST_P(GatheredLampsRender, LightsAsThePathTracerDoes)
{
    const Scene scene = test::window_room(GetParam());
    RenderOptions options;
    options.width = options.height = 64;
    options.aa = 1;
    settings_of(options).rays = 1024;
    settings_of(options).error_tolerance = 0.1f;
    const RenderResult result = test::render_first(scene, options);
    EXPECT_EQ(result.stats.records.gathered_lamps, 1u);
    ThreadPool pool(2);
    const RayScene rays = build_ray_scene(scene, pool);
    const LayeredImage reference =
        render_reference(rays, {scene.cameras[0], 64, 64, {0.5, 0.5}}, {.samples = 32768, .stride = 6}, pool);
    for (const char* layer : {"direct", "indirect", "beauty"}) {
        const ErrorMetrics metrics = compare_images(result.image, reference, layer);
        EXPECT_NEAR(metrics.ratio_of_means, 1.0, 0.02) << layer;
        EXPECT_LT(metrics.mean_relative_error, 0.1) << layer;
    }
}

// Lit by records, and by rays along the lobe.
INSTANTIATE_TEST_SUITE_P(Roughness, GatheredLampsRender, testing::Values(0.6f, 0.2f));

/// Narrow lobes share the rays that find such lamps between neighbours, as those that find other surfaces.
TEST(GatheredLamps, HighlightsAreLessNoisyThanByRaysOfEachPixelAlone)
{
    const Scene scene = test::window_room(0.2f);
    const auto render = [&](std::uint64_t seed, bool traced) {
        RenderOptions options;
        options.width = options.height = 96;
        options.aa = 1;
        options.seed = seed;
        if (!traced) options.effects.without = {Effect::traced_lobes};
        return test::render_first(scene, options);
    };
    const auto scatter = [&](bool traced) {
        const RenderResult a = render(1, traced), b = render(2, traced);
        const Image &first = a.image.layers.at("direct"), &second = b.image.layers.at("direct");
        double difference = 0.0, light = 0.0;
        for (std::size_t i = 0; i < first.pixels.size(); ++i) {
            const auto x = static_cast<double>(first.pixels[i]), y = static_cast<double>(second.pixels[i]);
            difference += (x - y) * (x - y);
            light += x * y;
        }
        EXPECT_EQ(a.stats.counts.highlight_rays == 0, traced) << "found once, not twice";
        return std::sqrt(difference / light);
    };
    EXPECT_LT(scatter(true), 0.7 * scatter(false));
}

TEST(GatheredLamps, RecordsOfOtherLampsAreNotMixedIn)
{
    const Scene scene = test::window_room(1.0f);
    RenderOptions options;
    options.width = options.height = 48;
    options.aa = 1;
    std::vector<Record> records = test::render_first(scene, options).records;
    ASSERT_FALSE(records.empty());
    for (const Record& r : records) ASSERT_NE(r.gathered_lamps, 0u);
    const RenderResult again = test::render_first(scene, options, 2, records);
    EXPECT_EQ(again.stats.records.records, 0u) << "all are at hand";
    for (Record& r : records) r.gathered_lamps ^= 2u;
    const RenderResult afresh = test::render_first(scene, options, 2, records);
    EXPECT_GT(afresh.stats.records.records, 0u);
}

}  // namespace
}  // namespace rcs
