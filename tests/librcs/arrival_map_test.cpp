#include "lit_points/arrival_map.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtx/norm.hpp>

#include "rcs/render.h"
#include "records/aimed_rays.h"
#include "records/guided_gathers.h"
#include "support/effect_scenes.h"
#include "support/seen_place.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kSize = 48, kApart = 7;  // of the view, and of pixels that gather [px]

struct Place : test::SeenPlace {
    explicit Place(Scene s) : SeenPlace(std::move(s), kSize) {}

    ArrivalMap map() const { return {make_cell_grid(bounds_of(scene), view), 1.0f}; }
};

std::uint16_t bin_of(glm::vec3 direction)
{
    std::uint16_t bin = 0;
    ArrivalMap::bins_of(Basis(glm::vec3(0.0f, 0.0f, 1.0f)), &direction.x, &direction.y, &direction.z, {&bin, 1});
    return bin;
}

struct Sums {
    double light = 0.0, harmonic = 0.0;
};

/// Over points, each with other rays. @param map  aims half of them and learns, if not null
Sums gather_all(Place& place, ArrivalMap* map, int rays, std::uint64_t seed)
{
    const int aimed = map ? rays / 2 : 0;
    const GatherSize size{make_hemisphere_grid(rays - aimed), 0, aimed};
    RecordSettings settings;
    settings.radiance = true;
    const Gatherer gatherer({place.rays, nullptr, nullptr, nullptr, nullptr, nullptr, map}, settings);
    GatherWorkspace w(size.cells());
    Sums sums;
    for (std::uint32_t i = 0; i < place.points.size(); i += kApart) {
        if (!place.points.covered(i)) continue;
        const Record r = gatherer.gather(birth_at(place.points, i, seed), size, w);
        sums.light += static_cast<double>(luminance(r.irradiance));
        sums.harmonic += static_cast<double>(r.radiance[0]);
    }
    if (map) map->learn(w.aimed.gathers, w.aimed.arrived, place.pool);
    return sums;
}

struct Spread {
    Sums mean;
    double variance = 0.0;
};

Spread repeat(Place& place, ArrivalMap* map, int rays, int times)
{
    Spread s;
    double squares = 0.0;
    for (int k = 0; k < times; ++k) {
        const Sums sums = gather_all(place, map, rays, static_cast<std::uint64_t>(k + 1));
        s.mean.light += sums.light / times;
        s.mean.harmonic += sums.harmonic / times;
        squares += sums.light * sums.light / times;
    }
    s.variance = (squares - s.mean.light * s.mean.light) / (times - 1);  // of the mean
    return s;
}

class AimedRaysIn : public testing::TestWithParam<Scene (*)()> {};

TEST_P(AimedRaysIn, FindTheLightThatRaysFind)
{
    Place place(GetParam()());
    const Spread truth = repeat(place, nullptr, 4096, 8);
    ASSERT_GT(truth.mean.light, 0.0);
    ArrivalMap map = place.map();
    const Spread aimed = repeat(place, &map, 128, 96);
    const double error = std::sqrt(truth.variance + aimed.variance);
    EXPECT_LT(error, 0.005 * truth.mean.light);
    EXPECT_NEAR(aimed.mean.light, truth.mean.light, 4.0 * error);
    EXPECT_NEAR(aimed.mean.harmonic / truth.mean.harmonic, aimed.mean.light / truth.mean.light, 0.01);
}

/// Of the translation gradients' luminance: how far those of single gathers lie from those of many.
struct GradientErrors {
    double bias = 0.0, scatter = 0.0;  // relative
};

GradientErrors gradient_errors(Place& place, ArrivalMap* map, int strata, int aimed)
{
    const RecordSettings settings;
    const auto gradients = [&](ArrivalMap* known, const GatherSize& size, int times, const auto& keep) {
        const Gatherer gatherer({place.rays, nullptr, nullptr, nullptr, nullptr, nullptr, known}, settings);
        GatherWorkspace w(size.cells());
        for (std::uint32_t i = 0; i < place.points.size(); i += 5 * kApart)
            for (int k = 0; place.points.covered(i) && k < times; ++k) {
                const Record r = gatherer.gather(birth_at(place.points, i, static_cast<std::uint64_t>(k + 1)), size, w);
                keep(i, glm::dvec3(r.translation_gradient[1]) / static_cast<double>(times));
            }
    };
    std::map<std::uint32_t, glm::dvec3> truth, mean;
    gradients(nullptr, {make_hemisphere_grid(4096)}, 16, [&](std::uint32_t i, glm::dvec3 g) { truth[i] += g; });
    constexpr int kTimes = 64;
    const GatherSize size{make_hemisphere_grid(strata), 0, aimed};
    GradientErrors e;
    gradients(map, size, kTimes, [&](std::uint32_t i, glm::dvec3 g) {
        mean[i] += g;
        e.scatter += glm::length2(static_cast<double>(kTimes) * g - truth[i]) / kTimes;
    });
    double all = 0.0;
    for (const auto& [i, g] : truth) {
        all += glm::length2(g);
        e.bias += glm::length2(mean[i] - g);
    }
    return {std::sqrt(e.bias / all), std::sqrt(e.scatter / all)};
}

TEST(AimedRays, TellGradientsToo)
{
    Place place(test::window_room(1.0f));
    ArrivalMap map = place.map();
    repeat(place, &map, 128, 8);
    const GradientErrors half = gradient_errors(place, nullptr, 64, 0), mixed = gradient_errors(place, &map, 64, 64);
    EXPECT_LT(mixed.scatter, 0.8 * half.scatter);
    EXPECT_LT(mixed.bias, 1.5 * half.bias) << "mostly noise: of means over 64";
}

Scene windows() { return test::window_room(1.0f); }
Scene lit_room() { return test::lit_room(); }
INSTANTIATE_TEST_SUITE_P(Rooms, AimedRaysIn, testing::Values(windows, lit_room));

TEST(ArrivalMap, SharesAreOfADensity)
{
    const CellGrid grid{};
    ThreadPool pool(3);
    ArrivalMap map(grid, 1.0f);
    const std::vector<ArrivedRay> rays{{bin_of({0, 0, 1}), 5.0f}, {bin_of({1, 0, 0}), 2.0f}};
    const std::vector<Arrivals> gathers{{map.cells({}, {0, 0, 1}), 0, 2}};
    map.learn(gathers, rays, pool);
    std::vector<float> sums(ArrivalMap::kBins);
    map.weigh(gathers[0].cells, {0, 0, 1}, sums);
    ASSERT_GT(sums.back(), 0.0f);
    double integral = 0.0;
    std::size_t bin = 0;
    constexpr int kSteps = 20000;
    for (int k = 0; k < kSteps; ++k) {
        const float at = (static_cast<float>(k) + 0.5f) / kSteps * sums.back();
        const float u = static_cast<float>(k % 101) / 101.0f;
        const ArrivalMap::Choice c = ArrivalMap::choose(sums, at, {u, static_cast<float>(k % 89) / 89.0f}, bin);
        EXPECT_NEAR(glm::length(c.direction), 1.0f, 1e-5f);
        const bool on_edge = k % 101 == 0 || k % 89 == 0;  // between bins
        EXPECT_TRUE(on_edge || bin_of(c.direction) == c.bin) << k;
        integral += 1.0 / static_cast<double>(ArrivalMap::density(sums, c.bin)) / kSteps;
    }
    // The mean of 1 / density is the solid angle of where it is not 0: the upper half, and bins at the horizon.
    EXPECT_NEAR(integral, 2.0 * 3.14159265, 0.35);
}

/// Sums are of whole numbers: whichever gather is learned first.
TEST(ArrivalMap, KnowsTheSameInAnyOrder)
{
    const CellGrid grid{};
    ThreadPool alone(1), three(3);
    ArrivalMap one(grid, 0.3f), two(grid, 0.3f);
    std::vector<ArrivedRay> rays, turned;
    for (int k = 0; k < 500; ++k)
        rays.push_back({static_cast<std::uint16_t>(k * 7 % 40), 1.0f / static_cast<float>(k + 1)});
    turned.assign(rays.rbegin(), rays.rend());
    const std::vector<Arrivals> gathers{{one.cells({}, {0, 0, 1}), 0, 500}};
    one.learn(gathers, rays, alone);
    two.learn(gathers, turned, three);
    std::vector<float> a(ArrivalMap::kBins), b(a);
    one.weigh(gathers[0].cells, {0, 0, -1}, a);
    two.weigh(gathers[0].cells, {0, 0, -1}, b);
    EXPECT_EQ(a, b);
}

/// The coarser cell of a gather is the finer one of another, farther from the camera.
TEST(ArrivalMap, KnowsTheSameByAnyNumberOfThreads)
{
    const CellGrid grid{};
    ThreadPool alone(1), four(4);
    ArrivalMap one(grid, 0.3f), many(grid, 0.3f);
    std::vector<ArrivedRay> rays;
    std::vector<Arrivals> gathers;
    for (std::uint32_t g = 0; g < 2000; ++g) {
        const std::uint64_t cell = g % 7;
        gathers.push_back({{cell, cell + 1 + g % 2}, static_cast<std::uint32_t>(rays.size()), 50});
        for (int k = 0; k < 50; ++k)
            rays.push_back({static_cast<std::uint16_t>(k % 3), 1.0f / static_cast<float>(k + 1)});
    }
    one.learn(gathers, rays, alone);
    many.learn(gathers, rays, four);
    std::vector<float> a(ArrivalMap::kBins), b(a);
    for (const std::uint64_t cell : {0, 3, 6, 7, 8}) {
        one.weigh({cell, cell + 1}, {0, 0, -1}, a);
        many.weigh({cell, cell + 1}, {0, 0, -1}, b);
        EXPECT_EQ(a, b) << cell;
    }
}

double indirect_of(const RenderResult& result)
{
    const std::vector<float>& values = result.image.layers.at("indirect").pixels;
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// By what earlier moments taught, whether light comes from there still or not.
TEST(ArrivalMap, AimsInEveryMoment)
{
    const auto room = [](float blue) {
        Scene scene = windows();
        scene.lights.push_back(test::point_light({0.0, 0.5, 0.0}, {0.0f, 0.0f, blue}));
        return scene;
    };
    constexpr int kSeeds = 2;
    double followed = 0.0, alone = 0.0;
    ThreadPool pool(2);
    for (int seed = 1; seed <= kSeeds; ++seed) {
        RenderOptions options = test::options_of_size(24, 24, 1);
        options.seed = static_cast<std::uint64_t>(seed);
        Session session(test::shared_gl(), pool, {.keep_records = true, .watch_records = true});
        for (const float blue : {0.1f, 3.0f, 2.0f}) {
            const Scene scene = room(blue);
            session.show(scene);
            const RenderResult now = render(session, scene.cameras[0], options);
            EXPECT_GT(now.stats.records.aimed_rays, 0u) << blue;
            if (blue != 2.0f) continue;
            followed += indirect_of(now);
            alone += indirect_of(test::render_first(scene, options));
        }
    }
    EXPECT_NEAR(followed, alone, 0.03 * alone);
}

}  // namespace
}  // namespace rcs
