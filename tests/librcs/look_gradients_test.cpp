#include "records/look_gradients.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rcs {
namespace {

/// cos cos' / d^2 between a place and a point, in double.
double geometry_term(glm::dvec3 normal, glm::dvec3 to, glm::dvec3 point_normal)
{
    const double d2 = glm::dot(to, to);
    return -glm::dot(normal, to) * glm::dot(point_normal, to) / (d2 * d2);
}

glm::dvec3 any_unit(std::mt19937& random)
{
    std::normal_distribution<double> part;
    return glm::normalize(glm::dvec3(part(random), part(random), part(random)));
}

TEST(LookGradients, AreHowTheGeometryTermChanges)
{
    std::mt19937 random(1);
    int compared = 0;
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 n = any_unit(random), m = any_unit(random), to = 3.0 * any_unit(random);
        const glm::dvec3 way = glm::normalize(to);
        if (glm::dot(n, way) < 0.02 || glm::dot(m, way) > -0.02) continue;
        const double here = geometry_term(n, to, m);
        const glm::vec3 moving = moving_of_look(glm::vec3(n), glm::vec3(to), glm::vec3(m));
        const glm::vec3 turning = turning_of_look(glm::vec3(n), glm::vec3(way));
        // A move along the surface, and a turn about an axis in it.
        const glm::dvec3 along = glm::normalize(glm::cross(n, any_unit(random)));
        constexpr double kStep = 1e-5;
        const double moved =
            (geometry_term(n, to - kStep * along, m) - geometry_term(n, to + kStep * along, m)) / (2.0 * kStep * here);
        const glm::dvec3 turned = glm::cross(along, n);
        const double turns = (geometry_term(n + kStep * turned, to, m) - geometry_term(n - kStep * turned, to, m)) /
                             (2.0 * kStep * here);
        EXPECT_NEAR(glm::dot(glm::dvec3(moving), along), moved, 1e-4 * (1.0 + std::abs(moved)));
        EXPECT_NEAR(glm::dot(glm::dvec3(turning), along), turns, 1e-4 * (1.0 + std::abs(turns)));
        ++compared;
    }
    EXPECT_GT(compared, 300);
}

// A record's normal, or a point's, that is at right angles to the way between them as far as floats go: the cosine is
// a rounding, or zero, and light over it was infinite.
TEST(LookGradients, AreFiniteEdgeOn)
{
    std::mt19937 random(2);
    int zeros = 0;
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 way(any_unit(random));
        const glm::vec3 across(glm::normalize(glm::cross(glm::dvec3(way), any_unit(random))));
        zeros += glm::dot(across, way) == 0.0f;
        EXPECT_EQ(turning_of_look(across, way), glm::vec3(0.0f));
        for (const float distance : {1e-6f, 1.0f, 1e6f})
            EXPECT_EQ(moving_of_look(way, distance * way, across), glm::vec3(0.0f));
    }
    EXPECT_GT(zeros, 100) << "the case that is meant";
}

}  // namespace
}  // namespace rcs
