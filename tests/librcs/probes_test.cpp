#include "accuracy/probes.h"

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "direct/direct.h"
#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "rcs/rcs.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

TEST(ErrorScale, IsReadBetweenParts)
{
    const ErrorScale scale({{0.01, 0.02, 0.02, 0.01}, {0.1, 0.05, 0.1, 0.05}});
    EXPECT_NEAR(scale.of_map(0.01), 2.0, 1e-12);
    EXPECT_NEAR(scale.of_map(0.1), 0.5, 1e-12);
    EXPECT_NEAR(scale.of_map(std::sqrt(0.001)), 1.0, 1e-12) << "by logarithms";
    EXPECT_NEAR(scale.of_map(1e-6), 2.0, 1e-12);
    EXPECT_NEAR(scale.of_map(1.0), 0.5, 1e-12);
    EXPECT_NEAR(scale.judged(0.05).mean, 0.1, 1e-7);
    EXPECT_NEAR(scale.judged(0.01).mean, 0.01, 1e-7);
    EXPECT_NEAR(scale.judged(0.02).typical, 0.01, 1e-7);
    EXPECT_EQ(ErrorScale().of_map(0.3), 1.0);
    EXPECT_EQ(ErrorScale().judged(0.3).mean, 0.3);
}

/// Records of a view, and what is splatted from them.
struct Placed {
    Scene scene;
    ThreadPool pool;
    RayScene rays;
    View view;
    GBuffer gbuffer;
    RecordSettings settings;
    std::vector<Record> records;

    explicit Placed(const std::string& name, int threads = 2)
        : scene(load_scene(name)),
          pool(threads),
          rays(build_ray_scene(scene, pool)),
          view(make_views(scene.cameras[0], 64, 64, 1)[0]),
          gbuffer(render_gbuffer(test::shared_gl(), rays, view, 1.0f, pool))
    {
        RecordStats stats;
        place_records({rays}, gbuffer, view, settings, pool, records, stats);
    }
    Placed(const Placed&) = delete;

    ErrorScale judge() { return look().scale; }

    struct Look {
        ErrorScale scale;
        double error;  ///< mean relative, of all
    };
    Look look()
    {
        SplatStats stats;
        const SplatSettings splat{settings.error_tolerance, 3.0f, true};
        const SplatBuffer sums = splat_tiles(records, gbuffer, view, splat, pool, stats);
        ErrorMap map = error_map(sums, stats, 3.0f, pool);
        Probes probes({rays}, gbuffer, settings, pool);
        probes.spend(1e5, sums, map);
        const ErrorScale found = probes.compare(sums, map);
        scale(map, found, pool);
        return {found, mean_errors(sums, map, found, pool).total};
    }
};

TEST(Probes, FindWhatAllRecordsHaveWrongTogether)
{
    Placed placed("demo:cornell");
    EXPECT_LT(placed.look().error, 0.12);
    for (Record& r : placed.records) {
        r.irradiance *= 1.5f;
        for (auto* gradient : {&r.rotation_gradient, &r.translation_gradient})
            for (glm::vec3& g : *gradient) g *= 1.5f;
    }
    // They agree as well as before, but a third of what they say is not there.
    EXPECT_NEAR(placed.look().error, 0.5, 0.1);
}

TEST(Probes, DoNotDependOnTheThreads)
{
    Placed one("demo:ajar", 1), three("demo:ajar", 3);
    const ErrorScale a = one.judge(), b = three.judge();
    for (const double told : {0.001, 0.01, 0.03, 0.1, 0.5}) {
        EXPECT_EQ(a.of_map(told), b.of_map(told));
        EXPECT_EQ(a.judged(told).mean, b.judged(told).mean);
    }
    EXPECT_NE(a.of_map(0.03), 1.0);
}

TEST(DirectError, IsWhatSeedsScatterBy)
{
    constexpr int kSeeds = 12;
    for (const char* name : {"demo:blinds", "demo:cornell"}) {
        const Scene scene = load_scene(name);
        ThreadPool pool(2);
        const RayScene rays = build_ray_scene(scene, pool);
        const View view = make_views(scene.cameras[0], 64, 64, 1)[0];
        const GBuffer gbuffer = render_gbuffer(test::shared_gl(), rays, view, 1.0f, pool);
        std::vector<double> sum(gbuffer.size()), off(gbuffer.size());
        std::vector<std::vector<float>> light;
        double told = 0.0, scatter = 0.0;
        for (int seed = 1; seed <= kSeeds; ++seed) {
            DirectSettings settings{.area_samples = 4, .penumbra_samples = 16, .error = true};
            settings.seed = static_cast<std::uint64_t>(seed);
            std::uint64_t shadow_rays = 0;
            const DirectLightResult lit = direct_light(rays, gbuffer, view, Shading{}, settings, pool, shadow_rays);
            ASSERT_FALSE(lit.irradiance_error.empty()) << name;
            for (std::size_t i = 0; i < sum.size(); ++i) {
                sum[i] += static_cast<double>(luminance(lit.irradiance[i])) / kSeeds;
                told += static_cast<double>(lit.irradiance_error[i]);
            }
            std::vector<float>& l = light.emplace_back();
            for (const glm::vec3& e : lit.irradiance) l.push_back(luminance(e));
        }
        for (const std::vector<float>& l : light)
            for (std::size_t i = 0; i < sum.size(); ++i) scatter += std::abs(static_cast<double>(l[i]) - sum[i]);
        EXPECT_GT(scatter, 0.0);
        EXPECT_NEAR(kMeanAbsolute * told / scatter, 1.0, 0.3) << name;
    }
}

TEST(ErrorEstimates, HoldOfThePictureAndOfItsIndirectLight)
{
    // What one picture tells scatters by a tenth.
    constexpr std::uint64_t kSeeds = 3;
    for (const char* name : {"demo:ajar", "demo:blinds", "demo:cornell", "demo:spheres"}) {
        const Scene scene = load_scene(name);
        ThreadPool pool(2);
        const View view{scene.cameras[0], 128, 128, {0.5, 0.5}};
        ReferenceOptions paths;
        paths.samples = 16384;  // whose own noise is part of what is found
        paths.stride = 4;
        const LayeredImage reference = render_reference(build_ray_scene(scene, pool), view, paths, pool);
        RenderOptions options;
        options.width = options.height = 128;
        options.aa = 1;
        glm::dvec2 told(0.0), found(0.0);  // of the picture, of its indirect light
        for (options.seed = 1; options.seed <= kSeeds; ++options.seed) {
            const RenderResult result = test::render_first(scene, options);
            told += glm::dvec2(result.stats.errors.image.mean_relative, result.stats.errors.indirect.mean_relative);
            found += glm::dvec2(compare_images(result.image, reference, "beauty").mean_relative_error,
                                compare_images(result.image, reference, "indirect").mean_relative_error);
        }
        for (int layer = 0; layer < 2; ++layer) {
            EXPECT_GT(told[layer], 0.67 * found[layer]) << name << ' ' << layer;
            EXPECT_LT(told[layer], 1.5 * found[layer]) << name << ' ' << layer;
        }
    }
}

TEST(ErrorEstimates, AreTheSameForAnyNumberOfThreads)
{
    RenderOptions options;
    options.width = options.height = 64;
    const Scene scene = load_scene("demo:blinds");
    const RenderResult one = test::render_first(scene, options, 1), three = test::render_first(scene, options, 3);
    EXPECT_GT(one.stats.errors.image.mean_relative, 0.0);
    EXPECT_EQ(one.stats.errors.image.mean_relative, three.stats.errors.image.mean_relative);
    EXPECT_EQ(one.stats.errors.indirect.p95_relative, three.stats.errors.indirect.p95_relative);
    EXPECT_GT(one.stats.probe_rays, 0u);
}

}  // namespace
}  // namespace rcs
