#include "lit_points/light_clusters.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "lit_points/learned_visibility.h"
#include "rcs/camera.h"
#include "util/random.h"

namespace rcs {
namespace {

LitPoints scattered(int count)
{
    LitPoints lit;
    RandomStream random(7);
    const auto next = [&] { return 2.0f * random.next() - 1.0f; };
    for (int i = 0; i < count; ++i) {
        const glm::vec3 at(next(), next(), next());
        const glm::vec3 normal = glm::normalize(glm::vec3(next(), next(), next()) + 1e-3f);
        lit.points.push_back({4.0f * at, 0.1f + random.next(), normal, 0.5f});
        lit.lights.emplace_back().place = static_cast<std::uint32_t>(i);
    }
    return lit;
}

float part_of(const LitPoint& point, glm::vec3 position, glm::vec3 normal)
{
    const glm::vec3 d = point.position - position;
    const float here = glm::dot(normal, d), there = -glm::dot(point.normal, d);
    if (here <= 0.0f || there <= 0.0f) return 0.0f;
    const float g = here * there / (glm::dot(d, d) * glm::dot(d, d));
    return g * point.bound / (g + point.bound);
}

TEST(LightClusters, KeepEveryPointWithItsLight)
{
    LitPoints lit = scattered(3000);
    const std::vector<LitPoint> before = lit.points;
    const LightClusters clusters(lit);
    EXPECT_EQ(clusters.size(), LightClusters::kMost);
    ASSERT_EQ(lit.points.size(), before.size());
    std::vector<int> seen(before.size());
    for (std::size_t i = 0; i < lit.points.size(); ++i) {
        EXPECT_EQ(lit.points[i].position, before[lit.lights[i].place].position);
        ++seen[lit.lights[i].place];
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size()));
}

TEST(LightClusters, PicksAddUpToAllPointsOfTheCluster)
{
    LitPoints lit = scattered(3000);
    LightClusters clusters(lit);
    clusters.set_bounds(lit.points);
    const glm::vec3 position(0.3f, -0.2f, 0.5f), normal(0.0f, 1.0f, 0.0f);
    double all = 0.0, picked = 0.0;
    for (const LitPoint& p : lit.points) all += static_cast<double>(p.power * part_of(p, position, normal));
    RandomStream random(3);
    constexpr int kPicks = 200;
    for (std::size_t c = 0; c < clusters.size(); ++c) {
        for (int k = 0; k < kPicks; ++k) {
            const float u = random.next();
            const LightClusters::Pick pick = clusters.pick(c, position, normal, {u, random.next()});
            if (!(pick.part > 0.0f)) continue;
            EXPECT_NEAR(pick.part, part_of(lit.points[pick.point], position, normal), 1e-5f * pick.part);
            picked += static_cast<double>(lit.points[pick.point].power * pick.part * pick.inverse_chance) / kPicks;
        }
    }
    EXPECT_NEAR(picked / all, 1.0, 0.01);
}

TEST(LightClusters, AnyThatMaySendLightHasSomeImportance)
{
    LitPoints lit = scattered(2000);
    LightClusters clusters(lit);
    clusters.set_bounds(lit.points);
    for (const glm::vec3 normal : {glm::vec3(0, 1, 0), glm::vec3(1, 0, 0), glm::vec3(0, 0, -1)}) {
        const glm::vec3 position(0.1f, 0.2f, -0.3f);
        std::vector<float> importance(clusters.size(), 1.0f);
        clusters.weigh(position, normal, importance.data());
        for (std::size_t c = 0; c < clusters.size(); ++c) {
            bool sends = false;
            for (int k = 0; k < 64; ++k)
                sends = sends || clusters.pick(c, position, normal, {static_cast<float>(k) / 64.0f, 0.5f}).part > 0.0f;
            if (sends) {
                EXPECT_GT(importance[c], 0.0f) << c;
            }
        }
    }
}

TEST(LearnedVisibility, FollowsWhatWasSeenFromThere)
{
    const Camera camera;
    const CellGrid grid = make_cell_grid({glm::dvec3(-5.0), glm::dvec3(5.0)}, View{camera, 64, 64});
    LearnedVisibility learned(grid, 3);
    const glm::vec3 up(0, 1, 0), here(1.0f, 0.0f, 1.0f), there(-4.0f, 0.0f, -4.0f);
    const LookCells at_here = learned.cells(here, up), at_there = learned.cells(there, up);
    ASSERT_NE(at_here, at_there);
    float chances[3];
    learned.estimate(at_here, LearnedVisibility::kLeastChance, chances);
    for (const float c : chances) EXPECT_EQ(c, 1.0f) << "nothing is known yet";
    std::vector<Look> looks;
    for (int i = 0; i < 400; ++i) {
        looks.push_back({at_here, 0, i % 4 == 0});
        looks.push_back({at_here, 1, false});
        looks.push_back({at_there, 0, true});
    }
    learned.learn(looks);
    learned.estimate(at_here, LearnedVisibility::kLeastChance, chances);
    EXPECT_NEAR(chances[0], 0.25f, 0.01f);
    EXPECT_GT(chances[1], 0.0f) << "what was never seen may be seen after all";
    EXPECT_LT(chances[1], 0.05f);
    EXPECT_EQ(chances[2], 1.0f);
    learned.estimate(at_there, LearnedVisibility::kLeastChance, chances);
    EXPECT_NEAR(chances[0], 1.0f, 0.01f);
    EXPECT_LT(chances[1], 0.1f) << "elsewhere nothing else is known of it";
    LearnedVisibility backwards(grid, 3);
    std::reverse(looks.begin(), looks.end());
    backwards.learn(looks);
    float same[3];
    backwards.estimate(at_there, LearnedVisibility::kLeastChance, same);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(same[i], chances[i]) << "the order of looks is that of threads";
}

}  // namespace
}  // namespace rcs
