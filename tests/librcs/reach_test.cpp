#include "records/reach.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include <glm/glm.hpp>

#include "util/random.h"

namespace rcs {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// What is known of a record that was looked at in scene 7.
RecordWatch watch(glm::dvec3 origin, const std::vector<WatchedWay>& rays, const std::vector<WatchedWay>& shadows = {})
{
    RecordWatch watch;
    watch.origin = glm::vec3(origin);
    watch.state = 7;
    watch.seen.resize(rays.size());
    watch.ways = rays;
    watch.ways.insert(watch.ways.end(), shadows.begin(), shadows.end());
    return watch;
}

/// Scene 8 is that of 7 but for what lies in the box.
struct Changed {
    std::vector<SceneChange> changes;
    SceneStates states;
    Changed(const Bounds& scene, const Bounds& box)
        : changes{{.state = 8, .everywhere = false, .where = {box}}},
          states{.now = 8, .changed = {}, .changes = changes, .box = scene}
    {
    }
};

/// By slabs.
bool goes_through(const Bounds& box, glm::dvec3 from, glm::dvec3 direction, double length)
{
    double begin = 0.0, end = length;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0.0) {
            if (from[axis] < box.min[axis] || from[axis] > box.max[axis]) return false;
            continue;
        }
        const double a = (box.min[axis] - from[axis]) / direction[axis];
        const double b = (box.max[axis] - from[axis]) / direction[axis];
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    return begin <= end;
}

/// Boxes of any size and place, and rays in and around a scene, some along its axes.
class ReachAt : public testing::TestWithParam<double> {
protected:
    double scale = GetParam();
    Bounds grid{scale * glm::dvec3(-3.0, 100.0, -0.5), scale* glm::dvec3(7.0, 104.0, 30.0)};
    RandomStream random{7};
    Reach::Ways ways;

    double next() { return static_cast<double>(random.next()); }
    glm::dvec3 place(double beyond)
    {
        const glm::dvec3 part(next(), next(), next());
        return grid.min + ((1.0 + 2.0 * beyond) * part - beyond) * (grid.max - grid.min);
    }
    glm::dvec3 direction(int i)
    {
        glm::dvec3 d(0.0);
        while (glm::length(d) < 0.1) d = 2.0 * glm::dvec3(next(), next(), next()) - 1.0;
        if (i % 5 == 0) d[i % 3] = 0.0;
        if (i % 7 == 0) d[(i + 1) % 3] = 0.0;
        return glm::length(d) > 0.0 ? glm::normalize(d) : glm::dvec3(0.0, 1.0, 0.0);
    }
};

TEST_P(ReachAt, IsOfRaysThatWhatHasChangedLiesInTheWayOf)
{
    int met = 0, through = 0;
    constexpr int kTimes = 50000;
    const double rim = 1e-4 * (grid.max.z - grid.min.z);
    for (int i = 0; i < kTimes; ++i) {
        const glm::vec3 from(place(i % 3 == 0 ? 0.5 : 0.0)), towards(direction(i));
        const float length = i % 4 == 0 ? kInfinity : static_cast<float>(8.0 * scale * next());
        const glm::dvec3 low = place(i % 6 == 0 ? 0.5 : 0.0);
        const Bounds box{low, low + next() * next() * scale * glm::dvec3(6.0, 2.0, 15.0)};
        const Changed changed(grid, box);
        const bool meets =
            Reach(changed.states, false).rays(watch(glm::dvec3(from), {{towards, length, 0}}), ways) != 0;
        met += meets;
        if (goes_through(box, glm::dvec3(from), glm::dvec3(towards), static_cast<double>(length))) {
            ++through;
            EXPECT_TRUE(meets) << i;
        } else if (meets) {
            EXPECT_TRUE(goes_through({box.min - 1.01 * rim, box.max + 1.01 * rim}, glm::dvec3(from),
                                     glm::dvec3(towards), static_cast<double>(length)))
                << i;
        }
    }
    EXPECT_GT(through, kTimes / 500);
    EXPECT_LT(met, kTimes / 10) << "it tells something";
}

TEST_P(ReachAt, IsOfRaysWhoseHitsGetOtherLight)
{
    const glm::dvec3 at = scale * glm::dvec3(0.0, 102.0, 1.0);
    const glm::vec3 along(0.0f, 0.0f, 1.0f), up(0.0f, 1.0f, 0.0f);
    const auto length = static_cast<float>(10.0 * scale), above = static_cast<float>(scale);
    // Rays 0 and 2 hit something 10 away, of which 2 has a shadow ray up; 1 is not shot.
    const RecordWatch known = watch(at, {{along, length, 0}, {-up, -1.0f, 1}, {along, length, 2}}, {{up, above, 2}});
    const auto box = [&](glm::dvec3 centre) {
        return Bounds{at + scale * (centre - 0.1), at + scale * (centre + 0.1)};
    };
    const auto rays = [&](glm::dvec3 centre) {
        const Changed changed(grid, box(centre));
        return Reach(changed.states, false).rays(known, ways);
    };
    EXPECT_EQ(rays({0.0, 0.0, 5.0}), 0b101u);
    EXPECT_EQ(rays({0.0, 0.0, 11.0}), 0u) << "behind what they hit";
    EXPECT_EQ(rays({0.0, 0.5, 10.0}), 0b100u) << "between that and a lamp";
    EXPECT_EQ(rays({0.0, 1.5, 10.0}), 0u) << "behind the lamp";
    EXPECT_EQ(rays({0.0, -0.5, 0.0}), 0u) << "a ray that was never shot";
}

INSTANTIATE_TEST_SUITE_P(Scales, ReachAt, testing::Values(1e-3, 1.0, 1e3));

TEST(Reach, IsEverywhereWhereNobodyKnowsBetter)
{
    const Bounds scene{glm::dvec3(0.0), glm::dvec3(10.0)}, far{glm::dvec3(8.0), glm::dvec3(9.0)};
    const RecordWatch known = watch(glm::dvec3(1.0), {{{1.0f, 0.0f, 0.0f}, 2.0f, 0}});
    Changed changed(scene, far);
    Reach::Ways ways;
    EXPECT_EQ(Reach(changed.states, false).rays(known, ways), 0u);
    EXPECT_NE(Reach(changed.states, true).rays(known, ways), 0u) << "light of further bounces";
    EXPECT_NE(Reach(changed.states, false).rays(watch(glm::dvec3(1.0), {}), ways), 0u) << "it was never looked at";
    RecordWatch old = known;
    old.state = 6;
    EXPECT_NE(Reach(changed.states, false).rays(old, ways), 0u) << "what changed before is not known";
    changed.changes[0].everywhere = true;
    EXPECT_NE(Reach(changed.states, false).rays(known, ways), 0u);
    RecordWatch current = known;
    current.state = 8;
    EXPECT_EQ(Reach(changed.states, false).rays(current, ways), 0u) << "nothing has changed since";
}

TEST(Reach, AddsUpWhatChangedFromSceneToScene)
{
    const Bounds scene{glm::dvec3(0.0), glm::dvec3(10.0)};
    Reach::Ways ways;
    RecordWatch known = watch(glm::dvec3(1.0), {{{1.0f, 0.0f, 0.0f}, 5.0f, 0}, {{0.0f, 1.0f, 0.0f}, 5.0f, 1}});
    const auto box = [](glm::dvec3 centre) { return Bounds{centre - 0.1, centre + 0.1}; };
    const std::vector<SceneChange> changes{
        {.state = 8, .everywhere = false, .where = {box({3.0, 1.0, 1.0})}},
        {.state = 9, .everywhere = false, .where = {box({1.0, 3.0, 1.0}), Bounds{}}}};
    const SceneStates states{.now = 9, .changed = {}, .changes = changes, .box = scene};
    EXPECT_EQ(Reach(states, false).rays(known, ways), 0b11u);
    known.state = 8;
    EXPECT_EQ(Reach(states, false).rays(known, ways), 0b10u);
}

}  // namespace
}  // namespace rcs
