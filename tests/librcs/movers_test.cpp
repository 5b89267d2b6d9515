#include "lamps/movers.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "lamps/lights.h"
#include "rcs/scene.h"
#include "util/random.h"

namespace rcs {
namespace {

Lights lit_by(std::vector<EmissiveTriangle> triangles)
{
    Lights lights;
    lights.triangles = std::move(triangles);
    return lights;
}

EmissiveTriangle triangle(glm::vec3 a, glm::vec3 b, glm::vec3 c)
{
    EmissiveTriangle t{};
    t.corner[0] = a, t.corner[1] = b, t.corner[2] = c;
    return t;
}

Bounds box(glm::vec3 a, glm::vec3 b) { return {glm::dvec3(glm::min(a, b)), glm::dvec3(glm::max(a, b))}; }

/// Whether a straight way meets a box, by slabs.
bool meets(const Bounds& box, glm::dvec3 from, glm::dvec3 to)
{
    double begin = 0.0, end = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double way = to[axis] - from[axis];
        const double a = (box.min[axis] - from[axis]) / way, b = (box.max[axis] - from[axis]) / way;
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    return begin <= end;
}

TEST(Movers, LeaveNoWayToALampOut)
{
    RandomStream random(5);
    const auto somewhere = [&](float size) { return size * glm::vec3(random.next(), random.next(), random.next()); };
    int untouched = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const glm::vec3 corner = somewhere(4.0f);
        const EmissiveTriangle lamp = triangle(corner, corner + somewhere(1.0f), corner + somewhere(1.0f));
        const glm::vec3 low = somewhere(4.0f);
        const Bounds thing = box(low, low + somewhere(1.5f));
        const Movers movers({&thing, 1}, lit_by({lamp}), false);
        const glm::vec3 point = somewhere(4.0f);
        if (movers.touch(point)) continue;
        ++untouched;
        for (int way = 0; way < 50; ++way) {
            float u = random.next(), v = random.next();
            if (u + v > 1.0f) u = 1.0f - u, v = 1.0f - v;
            const glm::vec3 at =
                lamp.corner[0] + u * (lamp.corner[1] - lamp.corner[0]) + v * (lamp.corner[2] - lamp.corner[0]);
            ASSERT_FALSE(meets(thing, glm::dvec3(point), glm::dvec3(at))) << trial;
        }
    }
    EXPECT_GT(untouched, 1000) << "most things are out of the way";
}

TEST(Movers, TouchAllWhereLampsAreEverywhere)
{
    const std::vector<EmissiveTriangle> lamp{triangle({0, 3, 0}, {1, 3, 0}, {0, 3, 1})};
    const Bounds far = box({50, 0, 0}, {51, 1, 1});
    const glm::vec3 point(0.0f);
    EXPECT_FALSE(Movers({&far, 1}, lit_by(lamp), false).touch(point));
    EXPECT_TRUE(Movers({&far, 1}, lit_by(lamp), true).touch(point)) << "the sky shines";
    EXPECT_TRUE(Movers({&far, 1}, lit_by(std::vector(257, lamp[0])), false).touch(point));
    Lights with_bulb = lit_by(lamp);
    with_bulb.punctual.emplace_back(PunctualLight{});
    EXPECT_TRUE(Movers({&far, 1}, with_bulb, false).touch(point));
    EXPECT_FALSE(Movers({}, with_bulb, true).touch(point)) << "nothing has moved";
    const Bounds nothing;
    EXPECT_FALSE(Movers({&nothing, 1}, lit_by(lamp), false).touch(point));
}

TEST(Movers, TouchWhatLiesOnThem)
{
    const std::vector<EmissiveTriangle> lamp{triangle({0, 3, 0}, {1, 3, 0}, {0, 3, 1})};
    const Bounds thing = box({4, 0, 0}, {5, 1, 1});
    const Movers movers({&thing, 1}, lit_by(lamp), false);
    EXPECT_TRUE(movers.touch({4.5f, 1.0f, 0.5f}));
    EXPECT_TRUE(movers.touch({4.0f, 0.5f, 0.5f}));
}

}  // namespace
}  // namespace rcs
