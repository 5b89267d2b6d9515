#include "placement/refine.h"
#include "records/gather.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/gbuffer.h"
#include "rcs/gl_context.h"
#include "support/same_bits.h"
#include "support/scenes.h"

namespace rcs {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kAlbedo = 0.5, kIntensity = 40.0, kCone = 0.2;  // of the bright spot: W/sr, rad

/// An empty room, lit by nothing but what a spot 80 cm wide, bright in its middle, on its wall at x = 2 reflects.
Scene bright_spot()
{
    Scene scene;
    const int wall = test::add_material(scene, glm::vec3(static_cast<float>(kAlbedo)));
    test::add_mesh(scene, test::box({-2, 0, -2}, {2, 3, 2}, wall, test::Facing::inwards));
    PunctualLight spot = test::point_light({0.0, 1.5, 0.0}, glm::vec3(static_cast<float>(kIntensity)));
    spot.kind = LightKind::spot;
    spot.direction = {1.0, 0.0, 0.0};
    spot.inner_cone = 0.0f;
    spot.outer_cone = static_cast<float>(kCone);
    scene.lights = {spot};
    scene.cameras = {look_at_camera("camera", {1.7, 1.6, 0.1}, {-2.0, 1.3, 0.0}, 1.3)};
    return scene;
}

/// Irradiance that the bright spot sends to a point: sum over its area of L cos cos' / d^2.
double irradiance_of_spot(glm::dvec3 p, glm::dvec3 n)
{
    constexpr int kSteps = 60;
    const double half = 2.0 * std::tan(kCone), step = 2.0 * half / kSteps;
    double sum = 0.0;
    for (int j = 0; j < kSteps; ++j) {
        for (int i = 0; i < kSteps; ++i) {
            const glm::dvec3 q(2.0, 1.5 - half + (j + 0.5) * step, -half + (i + 0.5) * step);
            const glm::dvec3 from_light = q - glm::dvec3(0.0, 1.5, 0.0), w = q - p;
            const double l = glm::length(from_light), d = glm::length(w);
            // KHR_lights_punctual: the square of a ramp in the cosine.
            const double edge = std::max(0.0, (2.0 / l - std::cos(kCone)) / (1.0 - std::cos(kCone)));
            const double radiance = kAlbedo / kPi * kIntensity * edge * edge * (2.0 / l) / (l * l);
            sum += radiance * std::max(0.0, glm::dot(n, w)) * std::max(0.0, w.x) / (d * d * d * d) * step * step;
        }
    }
    return sum;
}

using test::same_bits;

/// Largest distance of records [px].
float widest(const RecordSettings& options) { return options.error_tolerance * options.max_reach; }

/// Standard error [W m^-2].
double error_of(const Record& r)
{
    const glm::vec3 e = r.irradiance;
    return static_cast<double>(r.noise * (0.2126f * e.r + 0.7152f * e.g + 0.0722f * e.b));
}

/// Records at every n-th pixel of every n-th row of a scene's first camera. One reaches 36 pixels at the most.
struct Field {
    Scene scene;
    ThreadPool pool;
    RayScene rays;
    View view;
    GBuffer gbuffer;
    std::vector<std::uint32_t> pixels;
    RecordStats stats;  // of the last refined() or first()

    explicit Field(const Scene& made, std::uint32_t step = 7, int threads = 2)
        : scene(made), pool(threads), rays(build_ray_scene(scene, pool)), view(test::view_of(scene.cameras[0], 120, 90))
    {
        GlContext gl;
        gbuffer = render_gbuffer(gl, rays, view, 1.0f, pool);
        for (std::uint32_t y = 3; y < 90; y += step)
            for (std::uint32_t x = 3; x < 120; x += step) pixels.push_back(y * 120 + x);
    }

    std::vector<Record> first(const RecordSettings& options)
    {
        stats = {};
        std::vector<Record> records = RecordGatherer(rays, options).gather(gbuffer, pixels, pool, stats);
        limit_spacing(records, options, pool);
        return records;
    }

    /// @param fresh  how many of the records, from the back, may get more rays
    std::vector<Record> refined(std::vector<Record> records, const RecordSettings& options, std::size_t fresh)
    {
        stats = {};
        const RecordGatherer gatherer(rays, options);
        const std::span<const std::uint32_t> own = std::span(pixels).last(fresh);
        const std::vector<float> noise =
            noise_around(gatherer.rays(), gbuffer, view, options.error_tolerance, own, pool, records);
        const std::vector<int> extra = extra_gathers(std::span(records).last(fresh), noise, gatherer.rays(),
                                                     options.noise_target, widest(options), 2048);
        gatherer.gather_more(gbuffer, std::span(pixels).last(fresh), extra, std::span(records).last(fresh), pool, stats,
                             [](float) {});
        return records;
    }
    std::vector<Record> refined(const std::vector<Record>& records, const RecordSettings& options)
    {
        return refined(records, options, records.size());
    }

    /// Noise of a record's neighbourhood over what is allowed: the splat of variances as a plain double loop.
    double excess(const std::vector<Record>& records, std::size_t k, const RecordSettings& options) const
    {
        const double px = static_cast<double>(records[k].spacing_radius) / static_cast<double>(records[k].footprint);
        const double area = std::min(1.0, std::pow(px / static_cast<double>(widest(options)), 2.0));
        const double target = static_cast<double>(options.noise_target) / std::cbrt(area);
        double mean = 0.0, typical = 0.0, variance = 0.0, irradiance = 0.0, weight = 0.0;
        for (std::size_t j = 0; j < records.size(); ++j) {
            const Record& r = records[j];
            const double e = static_cast<double>(r.irradiance.g);  // all lights here are white
            mean += e / static_cast<double>(records.size());
            typical += static_cast<double>(r.noise * r.noise) / static_cast<double>(records.size());
            if (j == k) continue;
            const glm::dvec3 d = glm::dvec3(records[k].position) - glm::dvec3(r.position), n(r.normal);
            const double across = glm::dot(d, n);
            const double reach =
                static_cast<double>(r.spacing_radius) * std::max(2.0, 3.0 * static_cast<double>(r.gradient_scale));
            const double turned = std::max(0.0, 1.0 - glm::dot(n, glm::dvec3(records[k].normal)));
            const double w = std::max(
                0.0, 1.0 - std::sqrt(glm::dot(d, d) + 3.0 * across * across) / reach - std::sqrt(turned) / (0.2 * 3.0));
            weight += w;
            irradiance += w * e;
            variance += w * error_of(r) * error_of(r);
        }
        if (weight <= 0.1) return std::sqrt(typical) / target;
        const double e = irradiance / weight + 0.01 * mean;
        return std::sqrt(variance / weight / (1.0 + weight)) / (target * e);
    }
};

/// Sum of E_k - truth over the records: in its standard errors, and relative to the sum of truths, with its error.
struct Deviation {
    double standard_errors, relative, relative_error;
};
Deviation deviation(const std::vector<Record>& records, const std::vector<double>& truth)
{
    double sum = 0.0, squares = 0.0, exact = 0.0;
    for (std::size_t k = 0; k < records.size(); ++k) {
        const double off = static_cast<double>(records[k].irradiance.g) - truth[k % truth.size()];
        sum += off;
        squares += off * off;
        exact += truth[k % truth.size()];
    }
    return {sum / std::sqrt(squares), sum / exact, std::sqrt(squares) / exact};
}

TEST(ExtraGathers, KeepsTheMeanUnbiasedWhereABrightSpotIsRarelyHit)
{
    Field field(bright_spot(), 14);  // few neighbours: a record's own noise would count for much
    RecordSettings options;
    options.rays = 64;
    std::vector<double> truth;
    for (const Record& r : field.first(options))
        truth.push_back(irradiance_of_spot(glm::dvec3(r.position), glm::dvec3(r.normal)));
    std::vector<Record> all, self_judged;
    for (options.seed = 1; options.seed <= 60; ++options.seed) {
        const std::vector<Record> before = field.first(options);
        const std::vector<Record> after = field.refined(before, options);
        all.insert(all.end(), after.begin(), after.end());

        std::vector<Record> self = before;
        std::vector<int> extra;
        for (const Record& r : self) extra.push_back(r.noise > options.noise_target ? 30 : 0);
        RecordGatherer(field.rays, options)
            .gather_more(field.gbuffer, field.pixels, extra, self, field.pool, field.stats, [](float) {});
        self_judged.insert(self_judged.end(), self.begin(), self.end());
    }
    const Deviation fair = deviation(all, truth), wrong = deviation(self_judged, truth);
    EXPECT_LT(std::abs(fair.standard_errors), 4.0) << fair.relative;
    EXPECT_LT(fair.relative_error, 0.02) << "so that 4 standard errors are 8 %";
    EXPECT_LT(wrong.relative, -0.3) << "what a record that judges itself comes to";
}

TEST(ExtraGathers, GivesRaysByTheNoiseOfTheNeighboursAndLeavesQuietOnesAlone)
{
    Scene scene = test::furnished_room();
    for (Material& m : scene.materials) {
        m.base_color = glm::vec3(m.base_color.g);
        m.emission = glm::vec3(m.emission.g);
    }
    scene.lights.clear();
    Field field(scene);
    RecordSettings options;
    options.rays = 64;
    options.noise_target = 0.04f;
    const std::vector<Record> before = field.first(options);
    const std::vector<Record> after = field.refined(before, options);
    ASSERT_EQ(after.size(), before.size());
    const int cells = 65, most = 2048 / cells;  // 64 rays are 5 x 13 strata
    double expected_rays = 0.0, rms_before = 0.0, rms_after = 0.0;
    std::uint64_t changed = 0;
    for (std::size_t k = 0; k < before.size(); ++k) {
        const double wanted = 2.0 * field.excess(before, k, options);
        const double n = std::clamp(std::round(wanted), 1.0, static_cast<double>(most));
        expected_rays += cells * (n - 1.0);
        if (std::abs(wanted - 1.5) > 1e-3) {
            ASSERT_EQ(same_bits(before[k], after[k]), wanted < 1.5) << k << ": " << wanted;
        }
        EXPECT_EQ(after[k].spacing_radius, before[k].spacing_radius);
        if (same_bits(before[k], after[k])) continue;
        ++changed;
        EXPECT_EQ(after[k].position, before[k].position);
        EXPECT_EQ(after[k].harmonic_mean_distance, before[k].harmonic_mean_distance);
        rms_before += error_of(before[k]) * error_of(before[k]);
        rms_after += error_of(after[k]) * error_of(after[k]);
        // Itself is no neighbour, but is about as noisy: n gathers have 1/sqrt(n) of the error, give or take.
        if (before[k].noise > 0.0f) {
            EXPECT_LT(error_of(after[k]), 2.5 * error_of(before[k]) / std::sqrt(n)) << k;
        }
    }
    EXPECT_EQ(field.stats.refined, changed);
    EXPECT_GT(changed, before.size() / 5);
    EXPECT_LT(changed, before.size() * 4 / 5) << "some are quiet";
    EXPECT_EQ(field.stats.hemisphere_rays, field.stats.refining_rays);
    // Rounding may carry a record over the step to one gather more.
    EXPECT_NEAR(static_cast<double>(field.stats.refining_rays), expected_rays, 0.01 * expected_rays);
    EXPECT_LT(rms_after, 0.6 * rms_before);
}

TEST(ExtraGathers, NeverGivesARecordMoreThan2048RaysOrTheOptions)
{
    Field field(test::furnished_room());
    for (const int rays : {16, 17, 65, 100, 128, 700, 1000, 1500, 2048, 3000}) {
        RecordSettings options;
        options.rays = rays;
        options.noise_target = 1e-6f;
        std::vector<Record> records = field.first(options);
        const std::uint64_t once = field.stats.hemisphere_rays / records.size();
        field.refined(records, options, 1);
        const std::uint64_t used = once + field.stats.refining_rays;
        EXPECT_LE(used, std::max<std::uint64_t>(once, 2048u + 16u)) << rays << ", rounded to strata";
        EXPECT_GT(used, std::max<std::uint64_t>(once, 1024u) - 1u) << rays << ": as many as fit";
        EXPECT_EQ(field.stats.refined, used > once ? 1u : 0u);
    }
}

TEST(ExtraGathers, ChangesOnlyTheFreshOnes)
{
    Field field(bright_spot());
    RecordSettings options;
    options.rays = 64;
    const std::vector<Record> before = field.first(options);
    const std::vector<Record> after = field.refined(before, options, 40);
    EXPECT_GT(field.stats.refined, 0u);
    EXPECT_LE(field.stats.refined, 40u);
    for (std::size_t k = 0; k + 40 < before.size(); ++k) ASSERT_TRUE(same_bits(before[k], after[k])) << k;
}

TEST(ExtraGathers, GivesTheSameBitsForAnyNumberOfThreads)
{
    const Scene scene = bright_spot();
    RecordSettings options;
    options.rays = 64;
    Field one(scene, 7, 1), three(scene, 7, 3);
    const std::vector<Record> a = one.refined(one.first(options), options);
    const std::vector<Record> b = three.refined(three.first(options), options);
    EXPECT_GT(one.stats.refined, 0u);
    EXPECT_EQ(one.stats.refined, three.stats.refined);
    EXPECT_EQ(one.stats.refining_rays, three.stats.refining_rays);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(same_bits(a[k], b[k])) << k;
}

TEST(ExtraGathers, ShootsNothingWhereAnyNoiseWillDo)
{
    Field field(bright_spot());
    RecordSettings options;
    for (const float target : {1e6f, std::numeric_limits<float>::max(), std::numeric_limits<float>::infinity()}) {
        options.noise_target = target;
        const std::vector<Record> before = field.first(options);
        const std::vector<Record> after = field.refined(before, options);
        EXPECT_EQ(field.stats.hemisphere_rays + field.stats.shadow_rays + field.stats.refined, 0u);
        for (std::size_t k = 0; k < before.size(); ++k) ASSERT_TRUE(same_bits(before[k], after[k])) << k;
    }
}

TEST(ExtraGathers, ChoosesTheSameForAnyStrengthOfLight)
{
    std::vector<std::uint64_t> rays;
    for (const float strength : {0x1p-28f, 1.0f, 0x1p28f}) {
        Scene scene = bright_spot();
        for (PunctualLight& l : scene.lights) l.intensity *= strength;
        Field field(scene);
        RecordSettings options;
        options.rays = 64;
        field.refined(field.first(options), options);
        rays.push_back(field.stats.refining_rays);
    }
    EXPECT_GT(rays[0], 0u);
    EXPECT_EQ(rays[0], rays[1]);
    EXPECT_EQ(rays[2], rays[1]);
}

TEST(ExtraGathers, LeavesDarknessAndOpenSkyAlone)
{
    Scene dark = bright_spot();
    dark.lights.clear();
    Scene sky;
    test::add_mesh(sky, test::quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, test::add_material(sky, glm::vec3(0.5f))));
    sky.sky_radiance = glm::vec3(1.0f);
    sky.cameras = {look_at_camera("camera", {0.0, 4.0, 0.1}, {0.0, 0.0, 0.0}, 0.8)};
    for (const Scene& scene : {dark, sky}) {
        Field field(scene);
        RecordSettings options;
        options.noise_target = 1e-30f;  // its square is no float
        const std::vector<Record> before = field.first(options);
        const std::vector<Record> after = field.refined(before, options);
        for (std::size_t k = 0; k < before.size(); ++k) {
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(after[k].irradiance[c], before[k].irradiance[c], 1e-5f);
            ASSERT_EQ(after[k].harmonic_mean_distance, before[k].harmonic_mean_distance);
            ASSERT_TRUE(std::isfinite(after[k].noise));
        }
    }
}

TEST(ExtraGathers, OfNoneIsNothing)
{
    Field field(bright_spot());
    EXPECT_TRUE(field.refined({}, {}, 0).empty());
    const std::vector<Record> before = field.first({});
    const std::vector<Record> after = field.refined(before, {}, 0);
    EXPECT_EQ(field.stats.refined, 0u);
    for (std::size_t k = 0; k < before.size(); ++k) ASSERT_TRUE(same_bits(before[k], after[k]));
}

TEST(GatherMore, TellsHowFarItIsAndStopsWhenTheListenerThrows)
{
    Field field(bright_spot());
    RecordSettings options;
    options.rays = 16;
    std::vector<Record> records;
    std::vector<std::uint32_t> pixels;
    for (int copies = 0; copies < 12; ++copies) pixels.insert(pixels.end(), field.pixels.begin(), field.pixels.end());
    RecordStats stats;
    const RecordGatherer gatherer(field.rays, options);
    records = gatherer.gather(field.gbuffer, pixels, field.pool, stats);
    const std::vector<int> extra(pixels.size(), 1);
    float last = -1.0f;
    gatherer.gather_more(field.gbuffer, pixels, extra, records, field.pool, stats, [&](float fraction) {
        EXPECT_GT(fraction, last);
        EXPECT_LT(fraction, 1.0f);
        last = fraction;
    });
    EXPECT_GT(last, 0.0f) << pixels.size() << " records are more than one report";
    EXPECT_THROW(gatherer.gather_more(field.gbuffer, pixels, extra, records, field.pool, stats,
                                      [](float) { throw std::runtime_error("enough"); }),
                 std::runtime_error);
}

}  // namespace
}  // namespace rcs
