#include "records/ways.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include <glm/glm.hpp>

#include "util/random.h"

namespace rcs {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<std::uint64_t> copy(const Ways& ways) { return {ways.bits().begin(), ways.bits().end()}; }

Ways of_box(const Bounds& grid, const Bounds& box)
{
    Ways ways(grid);
    ways.add_box(box);
    return ways;
}

Ways of_segment(const Bounds& grid, glm::vec3 from, glm::vec3 direction, float length)
{
    Ways ways(grid);
    ways.add_segment(from, direction, length);
    return ways;
}

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

/// A box of any size and place, and rays in and around it, some along its axes and walls.
class WaysAt : public testing::TestWithParam<double> {
protected:
    double scale = GetParam();
    Bounds grid{scale * glm::dvec3(-3.0, 100.0, -0.5), scale* glm::dvec3(7.0, 104.0, 30.0)};
    RandomStream random{7};

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

TEST_P(WaysAt, MeetWhateverLiesInTheWay)
{
    int met = 0, through = 0;
    constexpr int kTimes = 50000;
    for (int i = 0; i < kTimes; ++i) {
        glm::vec3 from(place(i % 3 == 0 ? 0.5 : 0.0));
        if (i % 11 == 0)  // on a wall between cells
            from.y = static_cast<float>(grid.min.y + (grid.max.y - grid.min.y) * (i % Ways::kCells) / Ways::kCells);
        const glm::vec3 towards(direction(i));
        const float length = i % 4 == 0 ? kInfinity : static_cast<float>(8.0 * scale * next());
        const glm::dvec3 low = place(i % 6 == 0 ? 0.5 : 0.0);
        const Bounds box{low, low + next() * next() * scale * glm::dvec3(6.0, 2.0, 15.0)};
        const bool meets = of_box(grid, box).meet(of_segment(grid, from, towards, length).bits());
        met += meets;
        if (!goes_through(box, glm::dvec3(from), glm::dvec3(towards), static_cast<double>(length))) continue;
        ++through;
        EXPECT_TRUE(meets) << i;
    }
    EXPECT_GT(through, kTimes / 500);
    EXPECT_LT(met, kTimes / 2) << "it tells something";
}

TEST_P(WaysAt, OfBoxesHoldAllThatIsInThem)
{
    const Bounds whole = grid;
    EXPECT_TRUE(of_box(grid, whole).meet(of_segment(grid, glm::vec3(place(0.0)), {0.0f, 1.0f, 0.0f}, 0.0f).bits()));
    EXPECT_FALSE(of_box(grid, Bounds{}).meet(of_box(grid, whole).bits())) << "an empty one";
    EXPECT_TRUE(of_box(grid, {grid.max + scale, grid.max + 2.0 * scale})
                    .meet(of_segment(grid, glm::vec3(place(0.0)), {0.0f, 1.0f, 0.0f}, kInfinity).bits()))
        << "what goes out of the grid meets what lies there";
    Ways ways = of_box(grid, whole);
    ways.clear();
    EXPECT_EQ(copy(ways), copy(Ways(grid)));
}

INSTANTIATE_TEST_SUITE_P(Scales, WaysAt, testing::Values(1e-3, 1.0, 1e3));

TEST(Ways, OfAFlatSceneAndOfNone)
{
    const Bounds floor{glm::dvec3(0.0, 1.0, 0.0), glm::dvec3(10.0, 1.0, 10.0)};
    const Ways under = of_box(floor, {glm::dvec3(4.0, 1.0, 4.0), glm::dvec3(4.1, 1.0, 4.1)});
    EXPECT_TRUE(under.meet(of_segment(floor, {4.05f, 1.0f, 4.05f}, {0.0f, 1.0f, 0.0f}, 1.0f).bits()));
    EXPECT_FALSE(under.meet(of_segment(floor, {8.0f, 1.0f, 8.0f}, {0.0f, 1.0f, 0.0f}, 1.0f).bits()));
    const Ways none = of_box(Bounds{}, floor);
    EXPECT_TRUE(none.meet(of_segment(Bounds{}, {4.0f, 5.0f, 4.0f}, {0.0f, -1.0f, 0.0f}, kInfinity).bits()));
}

}  // namespace
}  // namespace rcs
