#include "light_cache/direct_cells.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "records/gatherer.h"
#include "records/guided_gathers.h"
#include "support/effect_scenes.h"
#include "support/seen_place.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kSize = 64, kApart = 13;  // of the view, and of pixels that gather [px]

struct Place : test::SeenPlace {
    HitRadiance light;

    explicit Place(Scene s, int size = kSize) : SeenPlace(std::move(s), size), light(rays, nullptr, effects) {}

    DirectCells cells(std::uint64_t seed) { return light_cells(rays, light, points, view, 1e6, seed, pool); }
};

/// Irradiance at a place by many samples.
double irradiance_at(const Place& place, const SurfacePoint& p, std::uint64_t seed)
{
    constexpr int kSamples = 1 << 14;
    double sum = 0.0;
    RandomStream random(stream_key(seed, Stream::gather, 7));
    for (int k = 0; k < kSamples; ++k)
        place.light.direct(p, random, [&](const Ray& ray, glm::vec3 white) {
            if (!occluded(place.rays, ray)) sum += static_cast<double>(luminance(white));
        });
    return std::numbers::pi * sum / kSamples;
}

TEST(DirectCells, HoldWhatArrivesInThem)
{
    Place place(test::lit_room());
    const DirectCells cells = place.cells(1);
    ASSERT_GT(cells.lights.size(), 100u);
    double sum = 0.0, truth = 0.0;
    int found = 0;
    RandomStream random(3);
    for (int i = 0; i < 400; ++i) {
        const glm::vec3 at(-1.9f, 0.1f + 0.12f * static_cast<float>(i / 20),
                           -1.9f + 0.19f * static_cast<float>(i % 20));
        SurfacePoint p{};
        p.position = {-2.0f, at.y, at.z};
        p.geometric_normal = p.shading_normal = {1, 0, 0};
        p.position_error = 1e-5f;
        const DirectCells::Light* const light = cells.at(p.position, p.shading_normal, random);
        if (!light) continue;
        ++found;
        sum += static_cast<double>(luminance(light->irradiance));
        truth += irradiance_at(place, p, static_cast<std::uint64_t>(i));
        EXPECT_TRUE(light->to_light == glm::vec3(0.0f) || std::abs(glm::length(light->to_light) - 1.0f) < 1e-5f);
    }
    ASSERT_GT(found, 80);
    ASSERT_GT(truth, 0.0);
    EXPECT_NEAR(sum / truth, 1.0, 0.03);
}

TEST(DirectCells, KnowNothingOfPlacesThatNobodySees)
{
    Place place(test::lit_room());
    const DirectCells cells = place.cells(1);
    RandomStream random(1);
    EXPECT_EQ(cells.at({-2.0f, 1.5f, 0.0f}, {-1, 0, 0}, random), nullptr) << "the wall's back";
    EXPECT_EQ(cells.at({40.0f, 0.0f, 0.0f}, {0, 1, 0}, random), nullptr) << "far outside";
}

/// Seen from close by, the mean of a cell is not what the place receives.
TEST(DirectCells, AreForRaysThatComeFromAfar)
{
    Place place(test::lit_room());
    const DirectCells cells = place.cells(1);
    const glm::vec3 wall(-2.0f, 1.0f, 0.0f);
    const float edge = cells.grid.edge(cells.grid.level(wall));
    EXPECT_FALSE(cells.serves(wall, 2.0f * edge));
    EXPECT_TRUE(cells.serves(wall, 8.0f * edge));
}

struct Gathered {
    double mean = 0.0, variance = 0.0;  // of one gather, means over the places
};

/// Gathers at every place, each with other rays. @param cells  null: shadow rays find the light
Gathered gather_at(const Place& place, const DirectCells* cells, int gathers, std::uint64_t seed)
{
    const GatherSize size{make_hemisphere_grid(128), 0};
    GatherWorkspace w(size.grid.cells);
    const Gatherer gatherer({place.rays, nullptr, nullptr, nullptr, nullptr, cells}, {});
    Gathered result;
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t i = 0; i < place.points.size(); i += kApart)
        if (place.points.covered(i)) pixels.push_back(i);
    const auto count = static_cast<double>(pixels.size());
    for (const std::uint32_t pixel : pixels) {
        double sum = 0.0, squares = 0.0;
        for (int k = 0; k < gathers; ++k) {
            const Birth birth = birth_at(place.points, pixel, seed, static_cast<std::uint64_t>(k));
            const auto e = static_cast<double>(luminance(gatherer.gather(birth, size, w).irradiance));
            sum += e / gathers;
            squares += e * e / gathers;
        }
        result.mean += sum / count;
        result.variance += (squares - sum * sum) / count;
    }
    return result;
}

TEST(DirectCells, BringTheSameLightWithLessNoise)
{
    Place place(test::window_room(1.0f));
    const Gathered plain = gather_at(place, nullptr, 32, 0);
    ASSERT_GT(plain.mean, 0.0);
    constexpr int kSets = 16;
    double mean = 0.0, square = 0.0, variance = 0.0;
    for (int set = 0; set < kSets; ++set) {
        const DirectCells cells = place.cells(static_cast<std::uint64_t>(set));
        const Gathered known = gather_at(place, &cells, 2, static_cast<std::uint64_t>(set));
        mean += known.mean / kSets;
        square += known.mean * known.mean / kSets;
        variance += known.variance / kSets;
    }
    const double error = std::sqrt((square - mean * mean) / kSets + plain.variance / (32.0 * kSize * kSize / kApart));
    EXPECT_LT(error, 0.01 * plain.mean);
    EXPECT_NEAR(mean, plain.mean, 4.0 * error);
    EXPECT_LT(variance, 0.7 * plain.variance);
}

TEST(DirectCells, AreLitOnlyWhereTheyHelp)
{
    const auto cells_of = [](Scene scene, bool steady) {
        Place place(std::move(scene), 4 * kSize);
        return search_light(place.rays, place.points, place.view, {}, steady, place.pool).direct != nullptr;
    };
    EXPECT_TRUE(cells_of(test::window_room(1.0f), true));
    EXPECT_FALSE(cells_of(test::window_room(1.0f), false)) << "what moves would not show in them";
    EXPECT_FALSE(cells_of(test::lit_room(), true)) << "one lamp, of which each ray's end sees all or nothing";
    EXPECT_FALSE(cells_of(test::room(0.5f), true)) << "no light";
}

TEST(DirectCells, PicturesDoNotDependOnTheThreads)
{
    const RenderOptions options = test::options_of_size(192, 108, 1);
    const Scene scene = load_scene("demo:blinds");
    const RenderResult one = test::render_first(scene, options, 1), three = test::render_first(scene, options, 3);
    ASSERT_GT(one.stats.records.direct_cells, 0u);
    ASSERT_GT(one.stats.records.aimed_rays, 0u);
    for (const auto& [name, layer] : one.image.layers)
        EXPECT_TRUE(layer.pixels == three.image.layers.at(name).pixels) << name;
}

}  // namespace
}  // namespace rcs
