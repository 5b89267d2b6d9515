#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "rcs/splat.h"
#include "shared/weight.h"
#include "splat/gpu_records.h"
#include "support/splat_wall.h"

namespace {

using namespace rcs;

GlContext& gl()
{
    static GlContext context;
    return context;
}

View test_view(int width, int height)
{
    View view;
    view.camera = look_at_camera("", {10.0, 2.0, -5.0}, {11.0, 1.5, -9.0}, 1.1);
    view.width = width;
    view.height = height;
    view.pixel_offset = {0.3, 0.6};
    return view;
}

/// A wavy surface some 4 m away, with holes.
GBuffer wavy_gbuffer(const View& view)
{
    GBuffer gbuffer;
    gbuffer.width = view.width;
    gbuffer.height = view.height;
    gbuffer.camera_position = camera_position(view.camera);
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const bool hole = (x / 5 + y / 3) % 7 == 0;
            const CameraRay ray = camera_ray(view, x + view.pixel_offset.x, y + view.pixel_offset.y);
            const double depth = 4.0 + 0.3 * std::sin(0.2 * x) * std::cos(0.3 * y);
            const glm::vec3 p = hole ? glm::vec3(0.0f) : glm::vec3(ray.direction * depth);
            const glm::dvec3 slope(0.2 * std::cos(0.2 * x), 0.2 * std::sin(0.3 * y), 1.0);
            const glm::vec3 n(glm::normalize(slope));
            gbuffer.position_x.push_back(p.x);
            gbuffer.position_y.push_back(p.y);
            gbuffer.position_z.push_back(p.z);
            gbuffer.normal_x.push_back(n.x);
            gbuffer.normal_y.push_back(n.y);
            gbuffer.normal_z.push_back(n.z);
            gbuffer.instance.push_back(hole ? GBuffer::kNone : 0u);
            gbuffer.primitive.push_back(hole ? GBuffer::kNone : 0u);
        }
    return gbuffer;
}

/// Records at pixels of the surface, some moved off it.
std::vector<Record> random_records(const GBuffer& gbuffer, int count)
{
    std::mt19937 engine(7);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    const auto signed_vector = [&] {
        const float x = uniform(engine);
        const float y = uniform(engine);
        return glm::vec3(x, y, uniform(engine)) * 2.0f - 1.0f;
    };
    std::vector<Record> records;
    for (int k = 0; k < count; ++k) {
        const std::size_t pixel = engine() % gbuffer.size();
        Record record;
        record.position = gbuffer.scene_position(pixel) + 0.05f * signed_vector();
        record.normal = glm::normalize(gbuffer.normal(pixel) + 0.1f * signed_vector());
        record.irradiance = 5.0f * (signed_vector() + 1.0f);
        for (std::size_t c = 0; c < 3; ++c) {
            record.rotation_gradient[c] = 3.0f * signed_vector();
            record.translation_gradient[c] = 5.0f * signed_vector();
        }
        record.noise = 0.1f;
        record.spacing_radius = 0.05f + 0.5f * uniform(engine);
        records.push_back(record);
    }
    return records;
}

struct Sums {
    double r = 0.0, g = 0.0, b = 0.0, weight = 0.0;
    double count = 0.0;
    double squares = 0.0, variance = 0.0, variance_of_sum = 0.0;
    bool at_rim = false;  ///< rounding decides whether some record counts at all
};

gpu::vec3 scalars(glm::vec3 v) { return {v.x, v.y, v.z}; }

/// All records at one pixel, without rectangles. The weight itself is shaders/shared/weight.h as C++: what is
/// tested is everything around it.
Sums sum_over_records(const std::vector<gpu::GpuRecord>& records, const GBuffer& gbuffer, std::size_t pixel)
{
    Sums sums;
    if (!gbuffer.covered(pixel)) return sums;
    const glm::vec3 n = gbuffer.normal(pixel);
    for (const gpu::GpuRecord& record : records) {
        const glm::vec3 d = gbuffer.position(pixel) - glm::vec3(record.position);
        const glm::vec3 kn(record.normal);
        const glm::vec3 r = glm::cross(kn, n);
        const double weight =
            gpu::rcs_interpolation_weight(scalars(d), scalars(n), scalars(kn), record.position.w, record.normal.w);
        if (weight > 0.0 && weight < 1e-5) sums.at_rim = true;
        if (!(weight > 0.0)) continue;
        double* const colors[] = {&sums.r, &sums.g, &sums.b};
        constexpr double kLuminance[] = {0.2126, 0.7152, 0.0722};
        double luminance = 0.0;
        for (int c = 0; c < 3; ++c) {
            const double e =
                gpu::rcs_extrapolate(record.irradiance[c], scalars(d), scalars(r),
                                     scalars(record.translation_gradient[c]), scalars(record.rotation_gradient[c]));
            *colors[c] += weight * e;
            luminance += kLuminance[c] * e * record.irradiance.w;
        }
        const double variance = record.rotation_gradient[0].w;
        sums.squares += weight * luminance * luminance;
        sums.variance += weight * variance;
        sums.variance_of_sum += weight * weight * variance;
        sums.weight += weight;
        sums.count += 1.0;
    }
    return sums;
}

TEST(SplatQuads, GiveTheSumsOfAPlainDoubleLoop)
{
    ThreadPool pool(2);
    const View view = test_view(61, 47);
    const GBuffer gbuffer = wavy_gbuffer(view);
    const std::vector<Record> records = random_records(gbuffer, 300);
    SplatSettings options;
    options.overlap = 2.0f;
    SplatStats stats;
    const SplatBuffer splats = splat_quads(gl(), records, gbuffer, view, options, pool, stats);

    GpuRecords from;
    append_gpu_records(records, gbuffer.camera_position, view, options, false, splats.luminance_unit, from);
    const std::vector<gpu::GpuRecord>& gpu_records = from.records;
    double most = 0.0;
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        const Sums sums = sum_over_records(gpu_records, gbuffer, i);
        most = std::max(most, sums.count);
        // 300 float additions and a few roundings in each weight stay far below the 1e-4 that quads and
        // tiles may differ by.
        EXPECT_NEAR(splats.weight[i], sums.weight, 1e-4 * sums.weight + 1e-6);
        EXPECT_NEAR(splats.weighted_r[i], sums.r, 1e-4 * sums.r + 1e-5);
        EXPECT_NEAR(splats.weighted_g[i], sums.g, 1e-4 * sums.g + 1e-5);
        EXPECT_NEAR(splats.weighted_b[i], sums.b, 1e-4 * sums.b + 1e-5);
        EXPECT_NEAR(splats.squares[i], sums.squares, 1e-4 * sums.squares + 1e-6);
        EXPECT_NEAR(splats.variance[i], sums.variance, 1e-4 * sums.variance + 1e-9);
        EXPECT_NEAR(splats.variance_of_sum[i], sums.variance_of_sum, 1e-4 * sums.variance_of_sum + 1e-9);
        EXPECT_TRUE(sums.at_rim || splats.count[i] == sums.count) << i << " has " << splats.count[i];
    }
    EXPECT_GT(most, 10.0);  // the records do overlap
    EXPECT_GT(stats.splats, 200u);
    EXPECT_LE(stats.splats, 300u);
    EXPECT_GT(stats.samples, stats.splats);
}

TEST(SplatQuads, LightGlossySurfacesAsTilesDo)
{
    const View view = test_view(61, 47);
    const GBuffer gbuffer = wavy_gbuffer(view);
    std::vector<Record> records = random_records(gbuffer, 300);
    const Shading shading = test::make_glossy(gbuffer, records);
    ThreadPool pool(2);
    SplatSettings options;
    options.overlap = 2.0f;
    SplatStats stats;
    const SplatBuffer quads = splat_quads(gl(), records, gbuffer, view, options, pool, stats, &shading);
    const SplatBuffer tiles = splat_tiles(records, gbuffer, view, options, pool, stats, &shading);
    const SplatBuffer plain = splat_tiles(records, gbuffer, view, options, pool, stats);
    EXPECT_EQ(tiles.weighted_g, plain.weighted_g);
    EXPECT_EQ(tiles.luminance_unit, quads.luminance_unit);
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        EXPECT_NEAR(quads.squares[i], tiles.squares[i], 1e-4f * tiles.squares[i] + 1e-7f);
        EXPECT_NEAR(quads.variance[i], tiles.variance[i], 1e-4f * tiles.variance[i] + 1e-9f);
        EXPECT_NEAR(quads.variance_of_sum[i], tiles.variance_of_sum[i], 1e-4f * tiles.variance_of_sum[i] + 1e-9f);
    }
    EXPECT_TRUE(plain.glossy_g.empty());
    std::size_t lit = 0;
    for (std::size_t i = 0; i < gbuffer.size(); ++i) {
        const float most =
            std::max({std::abs(tiles.glossy_r[i]), std::abs(tiles.glossy_g[i]), std::abs(tiles.glossy_b[i])});
        EXPECT_NEAR(quads.glossy_r[i], tiles.glossy_r[i], 1e-4f * most);
        EXPECT_NEAR(quads.glossy_g[i], tiles.glossy_g[i], 1e-4f * most);
        EXPECT_NEAR(quads.glossy_b[i], tiles.glossy_b[i], 1e-4f * most);
        if (!gbuffer.covered(i) || !shading.recorded(i))
            EXPECT_EQ(most, 0.0f);
        else
            lit += most > 0.0f;
    }
    EXPECT_GT(lit, gbuffer.size() / 3);
}

TEST(SplatQuads, AreTheSameBitsRunAfterRun)
{
    ThreadPool pool(2);
    const View view = test_view(61, 47);
    const GBuffer gbuffer = wavy_gbuffer(view);
    const std::vector<Record> records = random_records(gbuffer, 300);
    SplatStats stats;
    const SplatBuffer first = splat_quads(gl(), records, gbuffer, view, {}, pool, stats);
    const SplatBuffer second = splat_quads(gl(), records, gbuffer, view, {}, pool, stats);
    EXPECT_EQ(first.weight, second.weight);
    EXPECT_EQ(first.weighted_g, second.weighted_g);
    EXPECT_EQ(first.count, second.count);
}

TEST(SplatQuads, OfNoRecordAreZero)
{
    ThreadPool pool(2);
    const View view = test_view(5, 4);
    const GBuffer gbuffer = wavy_gbuffer(view);
    SplatStats stats;
    const SplatBuffer splats = splat_quads(gl(), {}, gbuffer, view, {}, pool, stats);
    EXPECT_EQ(splats.weight, std::vector<float>(20, 0.0f));
    EXPECT_EQ(stats.splats, 0u);
}

// 4.5 million pixels need two bands; one record surrounds the camera and so reaches both.
TEST(SplatQuads, OfALargeImageHaveNoSeamBetweenTheirBands)
{
    ThreadPool pool(2);
    const View view = test_view(3000, 1500);
    const GBuffer gbuffer = wavy_gbuffer(view);
    Record record;
    record.position = glm::vec3(gbuffer.camera_position);
    record.normal = {0.0f, 0.0f, 1.0f};
    record.irradiance = glm::vec3(1.0f);
    record.spacing_radius = 100.0f;
    SplatSettings options;
    options.error_tolerance = 1.0f;  // whatever the normal
    SplatStats stats;
    const SplatBuffer splats = splat_quads(gl(), {record}, gbuffer, view, options, pool, stats);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < gbuffer.size(); ++i) wrong += (splats.count[i] == 1.0f) != gbuffer.covered(i);
    EXPECT_EQ(wrong, 0u);
    EXPECT_EQ(stats.samples, 4500000u);
}

TEST(MakeGpuRecords, DropsRecordsThatReachNoPixelAndKeepsTheOrder)
{
    const View view = test_view(64, 64);
    const GBuffer gbuffer = wavy_gbuffer(view);
    std::vector<Record> records = random_records(gbuffer, 6);
    for (std::size_t k = 0; k < records.size(); ++k) records[k].irradiance = glm::vec3(static_cast<float>(k));
    const CameraRay middle = camera_ray(view, 32.0, 32.0);
    records[1].position = glm::vec3(middle.origin - 5.0 * middle.direction);  // behind the camera
    records[4].spacing_radius = 0.0f;
    GpuRecords from;
    append_gpu_records(records, gbuffer.camera_position, view, {}, false, 1.0f, from);
    const std::vector<gpu::GpuRecord>& kept = from.records;
    ASSERT_EQ(kept.size(), 4u);
    const float expected[] = {0.0f, 2.0f, 3.0f, 5.0f};
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(kept[k].irradiance.r, expected[k]);
}

}  // namespace
