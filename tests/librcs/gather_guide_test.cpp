#include "lit_points/gather_guide.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "facts/scene_effects.h"
#include "records/gatherer.h"
#include "records/guided_gathers.h"
#include "support/effect_scenes.h"
#include "support/place.h"
#include "support/session.h"
#include "util/color.h"

namespace rcs {
namespace {

std::vector<glm::vec2> scattered_points()
{
    std::vector<glm::vec2> floor;
    for (int i = 0; i < 24; ++i)
        floor.emplace_back(-1.7f + 0.147f * static_cast<float>(i), 1.6f - 0.31f * static_cast<float>(i % 7));
    return floor;
}

struct Place : test::Place {
    explicit Place(Scene s) : test::Place(std::move(s), scattered_points()) {}

    LightSurvey survey(std::uint64_t seed)
    {
        return survey_light({rays, HitRadiance(rays, nullptr, scene_effects(rays)), least_hit_alpha(128)}, points, view,
                            seed, pool);
    }
};

/// A screen hides the lamp, but not what it lights, from most of the floor.
Scene hidden_lamp()
{
    Scene scene = test::lit_room();
    Mesh screen = test::quad({0.4f, 0.0f, -2.0f}, {0, 2.2f, 0}, {0, 0, 3.2f}, 0);
    test::add_mesh(scene, screen);
    return scene;
}

Scene hidden_panel()
{
    Scene scene = hidden_lamp();
    scene.lights.clear();
    Material lamp;
    lamp.emission = glm::vec3(8.0f, 6.0f, 3.0f);
    lamp.base_color = glm::vec3(0.0f);
    test::add_mesh(scene, test::quad({1.2f, 2.2f, -0.5f}, {0.4f, 0, 0}, {0, 0, 0.4f}, test::add_surface(scene, lamp)));
    return scene;
}

/// Glossy walls, textured by nothing, under a sky that comes in where the ceiling is open.
Scene open_room()
{
    Scene scene;
    Material glossy;
    glossy.base_color = glm::vec3(0.7f, 0.5f, 0.4f);
    glossy.roughness = 0.3f;
    glossy.specular = 1.0f;
    glossy.double_sided = true;
    const int m = test::add_surface(scene, glossy);
    test::add_mesh(scene, test::quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, m));
    test::add_mesh(scene, test::quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, m));
    test::add_mesh(scene, test::quad({-2, 0, 2}, {0, 0, -4}, {0, 3, 0}, m));
    test::add_mesh(scene, test::quad({2, 0, -2}, {0, 0, 4}, {0, 3, 0}, m));
    test::add_mesh(scene, test::quad({-2, 3, -2}, {3, 0, 0}, {0, 0, 4}, m));
    scene.sky_radiance = glm::vec3(1.0f, 1.5f, 2.0f);
    scene.cameras = {look_at_camera("camera", {0.0, 1.5, 1.8}, {0.0, 1.0, -2.0}, 0.9)};
    return scene;
}

struct Sums {
    double light = 0.0, of_looks = 0.0;
    glm::dvec3 gradient{0.0}, turn{0.0};
    double harmonic = 0.0;  // the radiance's constant one

    void add(const Record& r, const GatherWorkspace& w)
    {
        light += static_cast<double>(luminance(r.irradiance));
        for (const glm::vec3& arrived : w.arrived) of_looks += static_cast<double>(luminance(arrived));
        gradient += glm::dvec3(r.translation_gradient[0]);
        turn += glm::dvec3(r.rotation_gradient[0]);
        harmonic += static_cast<double>(r.radiance[0]);
    }
};

/// Over all points.
Sums gather(Place& place, const Gatherer& gatherer, const GatherSize& size, std::uint64_t seed, GatherGuide* guide)
{
    Sums sums;
    GatherWorkspace w(size.grid.cells);
    for (std::uint32_t i = 0; i < place.points.size(); ++i) {
        w.arrived.clear();
        sums.add(gatherer.gather(birth_at(place.points, i, seed), size, w), w);
    }
    if (guide) guide->learn(w.looks);
    return sums;
}

class GuidedGathers : public testing::TestWithParam<Scene (*)()> {};

TEST_P(GuidedGathers, FindTheLightThatRaysFind)
{
    Place place(GetParam()());
    RecordSettings settings;
    settings.radiance = true;
    const GatherSize many{make_hemisphere_grid(16384), 0}, few{make_hemisphere_grid(64), 64};
    const Sums truth = gather(place, Gatherer(place.rays, settings), many, 1, nullptr);
    Sums found;
    constexpr int kSeeds = 24, kRounds = 4;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        GatherGuide guide(place.survey(seed), 16384.0, place.pool);
        ASSERT_TRUE(guide.has_light());
        const Gatherer guided({place.rays, nullptr, &guide}, settings);
        for (std::uint64_t round = 0; round < kRounds; ++round) {
            const Sums s = gather(place, guided, few, 100 * seed + round, &guide);
            const double part = 1.0 / (kSeeds * kRounds);
            found.light += part * s.light;
            found.of_looks += part * s.of_looks;
            found.gradient += part * s.gradient;
            found.turn += part * s.turn;
            found.harmonic += part * s.harmonic;
        }
    }
    EXPECT_GT(found.of_looks, 0.15 * found.light) << "else it would be rays alone that are tested";
    EXPECT_NEAR(found.light / truth.light, 1.0, 0.01);
    EXPECT_NEAR(found.harmonic / truth.harmonic, 1.0, 0.01);
    EXPECT_LT(glm::length(found.turn - truth.turn), 0.03 * truth.light);
}

INSTANTIATE_TEST_SUITE_P(Rooms, GuidedGathers, testing::Values(hidden_lamp, hidden_panel, open_room));

/// What lobes at lit points show changes as the place moves that looks at them, as looks from beside it say.
TEST(GatherGuide, LooksAtLobesChangeAsThePlaceMoves)
{
    Place place(test::panel_room(test::glossy(1.0f, 0.6f, glm::vec3(0.9f))));
    const GatherGuide guide(place.survey(1), 16384.0, place.pool);
    const LitPoints& lit = guide.lit();
    const HitRadiance radiance(place.rays, nullptr, effects_or_scene(std::nullopt, place.rays));
    const Basis frame({0.0f, 1.0f, 0.0f});
    const glm::vec3 at(0.3f, 0.0f, -0.4f);
    int glossy = 0;
    double largest = 0.0;
    for (std::size_t i = 0; i < lit.points.size(); ++i) {
        const glm::vec3 way = at - lit.points[i].position;
        const float distance = glm::length(way), h = 0.1f * distance;
        const ChangeAlong moving = lit.moving_of_radiance_area(i, way / distance, distance, frame);
        if (moving[0] == glm::vec3(0.0f)) continue;
        ++glossy;
        for (const auto& [axis, change] : {std::pair(frame.x, moving[0]), std::pair(frame.y, moving[1])}) {
            const glm::vec3 ahead = lit.radiance_area(radiance, i, glm::normalize(way + h * axis));
            const glm::vec3 back = lit.radiance_area(radiance, i, glm::normalize(way - h * axis));
            const double expected = static_cast<double>((ahead - back).g) / static_cast<double>(2.0f * h);
            EXPECT_NEAR(static_cast<double>(change.g), expected, 1e-3 * std::abs(expected) + 1e-9) << i;
            largest = std::max(largest, std::abs(expected) * static_cast<double>(distance / ahead.g));
        }
    }
    EXPECT_GT(glossy, 100);
    EXPECT_GT(largest, 0.5) << "else there is nothing to see";
}

const Bounds kThing{{0.9, 1.2, -0.9}, {1.5, 1.5, 0.1}};  // below the panel

Scene panel_above(double moved)
{
    Scene scene = hidden_panel();
    test::add_mesh(scene, test::box(glm::vec3(kThing.min), glm::vec3(kThing.max), 0, test::Facing::outwards));
    scene.instances.back().world_from_object[3].z += moved;
    return scene;
}

/// Points were lit before the thing moved: what it shades now, or shaded then, rays find.
TEST(GatherGuide, LeavesWhatHasMovedToRays)
{
    constexpr double kMoved = 1.0;
    Place before(panel_above(0.0)), now(panel_above(kMoved));
    RecordSettings settings;
    settings.radiance = true;
    const GatherSize many{make_hemisphere_grid(16384), 0}, few{make_hemisphere_grid(64), 64};
    const double truth = gather(now, Gatherer(now.rays, settings), many, 1, nullptr).light;
    const Bounds moved[2] = {kThing, {kThing.min + glm::dvec3(0, 0, kMoved), kThing.max + glm::dvec3(0, 0, kMoved)}};
    double found = 0.0, of_looks = 0.0, as_before = 0.0;
    constexpr int kSeeds = 24;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        GatherGuide guide(before.survey(seed), 16384.0, before.pool);
        const Gatherer guided({now.rays, nullptr, &guide}, settings);
        as_before += gather(now, guided, few, seed, nullptr).light / kSeeds;
        guide.leave_out(Movers(moved, *now.rays.impl().lights, false), now.pool);
        const Sums sums = gather(now, guided, few, seed, nullptr);
        found += sums.light / kSeeds;
        of_looks += sums.of_looks / kSeeds;
    }
    EXPECT_NEAR(found / truth, 1.0, 0.01);
    EXPECT_GT(of_looks, 0.1 * found);
    EXPECT_GT(std::abs(as_before / truth - 1.0), 0.03) << "else nothing is tested";
    GatherGuide guide(before.survey(1), 16384.0, before.pool);
    EXPECT_FALSE(guide.leave_out(Movers(moved, *now.rays.impl().lights, true), now.pool)) << "the sky is everywhere";
}

TEST(GatherGuide, TakesTheSamePlaceWhateverTheThreads)
{
    Place place(hidden_lamp());
    ThreadPool one(1), three(3);
    const GatherGuide a(place.survey(5), 4096.0, one), b(place.survey(5), 4096.0, three);
    ASSERT_EQ(a.lit().points.size(), b.lit().points.size());
    for (std::size_t i = 0; i < a.lit().points.size(); ++i) {
        EXPECT_EQ(a.lit().points[i].position, b.lit().points[i].position);
        EXPECT_EQ(a.lit().points[i].power, b.lit().points[i].power);
        EXPECT_EQ(a.lit().points[i].bound, b.lit().points[i].bound);
    }
}

TEST(GatherGuide, DoesNotDependOnHowBrightTheLampsAre)
{
    const auto lit_points_of = [](float scale) {
        Scene scene = hidden_panel();
        for (Material& material : scene.materials) material.emission *= scale;
        Place place(std::move(scene));
        return GatherGuide(place.survey(5), 4096.0, place.pool).lit();
    };
    const LitPoints plain = lit_points_of(1.0f);
    ASSERT_GT(plain.points.size(), 1000u);
    for (const float scale : {0x1p-90f, 0x1p+90f}) {
        const LitPoints scaled = lit_points_of(scale);
        ASSERT_EQ(scaled.points.size(), plain.points.size()) << scale;
        for (std::size_t i = 0; i < plain.points.size(); ++i) {
            EXPECT_EQ(scaled.points[i].position, plain.points[i].position) << scale;
            EXPECT_EQ(scaled.points[i].power, plain.points[i].power) << scale;
            EXPECT_EQ(scaled.points[i].bound, plain.points[i].bound) << scale;
        }
    }
}

TEST(GatherGuide, IsMadeOnlyWhereItHelps)
{
    const auto guide_of = [](Scene scene, int bounces) {
        Place place(std::move(scene));
        RecordSettings settings;
        settings.bounces = bounces;
        return search_light(place.rays, place.points, place.view, settings, true, place.pool).guide;
    };
    EXPECT_EQ(guide_of(hidden_panel(), 0), nullptr) << "nothing reflected is asked for";
    EXPECT_EQ(guide_of(test::room(0.5f), 1), nullptr) << "no light";
}

/// With how many of four seeds records look at lit points.
int seeds_that_look(const Scene& scene, const char* camera)
{
    RenderOptions options = test::options_of_size(96, 54, 1);
    options.quality = TargetIndirectError{0.2};
    int count = 0;
    for (options.seed = 1; options.seed <= 4; ++options.seed)
        count += test::render_view(scene, find_camera(scene, camera), options).stats.records.lit_points > 0;
    return count;
}

// With few points they seem to do good in the walk through demo:atrium, by chance, and with all of them they do not:
// three seeds of four had them there, and 1.4 times the error.
TEST(GatherGuide, IsMadeOnlyWhereItHelpsWithAllItsPoints)
{
    EXPECT_LE(seeds_that_look(load_scene("demo:atrium", {}, {.time = 0.25}), "walk"), 1);
    EXPECT_GE(seeds_that_look(load_scene("demo:cornell"), "0"), 3);
}

// Here rays alone are off by .45, and what all records share by the points is .03 of the light.
TEST(GatherGuide, IsKeptWhereRaysAloneLeaveFarMore)
{
    RenderOptions options = test::options_of_size(320, 180, 1);
    options.seed = 3;
    EXPECT_GT(test::render_first(load_scene("demo:ajar"), options).stats.records.lit_points, 0u);
}

// Of few rays most are strata, in a first gather: what the looks that are left gain there is not worth it.
TEST(GatherGuide, IsJudgedByTheLooksOfAFirstGather)
{
    RenderOptions options = test::options_of_size(160, 90, 1);
    options.quality = QualitySettings{.error_tolerance = 0.9f, .rays = 48, .noise_target = 1.0f};
    for (options.seed = 3; options.seed <= 5; ++options.seed)
        EXPECT_EQ(test::render_first(load_scene("demo:ajar"), options).stats.records.lit_points, 0u);
}

TEST(GatherGuide, PicturesDoNotDependOnTheThreads)
{
    RenderOptions options;
    options.width = options.height = 64;
    options.aa = 1;
    const Scene scene = load_scene("demo:ajar");
    const RenderResult one = test::render_first(scene, options, 1), three = test::render_first(scene, options, 3);
    ASSERT_GT(one.stats.records.lit_points, 0u);
    ASSERT_GT(one.stats.records.looks, 0u);
    for (const auto& [name, layer] : one.image.layers)
        EXPECT_TRUE(layer.pixels == three.image.layers.at(name).pixels) << name;
}

}  // namespace
}  // namespace rcs
