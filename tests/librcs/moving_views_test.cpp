#include "material/moving_views.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "support/lobes.h"

namespace rcs {
namespace {

const Basis kFrame({0.0f, 0.0f, -1.0f});  // of a place that looks down at the surface
const glm::vec3 kIncoming = glm::normalize(glm::vec3(0.4f, -0.2f, 1.0f));

Bsdf metal(float alpha) { return test::surface_of({make_lobe<Specular>(glm::vec3(0.9f, 0.7f, 0.3f), 1.0f, alpha)}); }

/// Of pi times the BSDF, per metre, from places a hair beside. @param at  where the surface is seen from
glm::vec3 slope(const Bsdf& bsdf, glm::vec3 at, glm::vec3 way)
{
    const float h = 1e-3f * glm::length(at);
    const glm::vec3 ahead = glm::normalize(at + h * way), back = glm::normalize(at - h * way);
    return std::numbers::pi_v<float> / (2.0f * h) *
           (evaluate(bsdf, ahead, kIncoming) - evaluate(bsdf, back, kIncoming));
}

TEST(MovingViews, ChangeAboutAsTheDerivativeOfALobeThatIsWide)
{
    const Bsdf bsdf = metal(0.39f);
    for (const float distance : {0.01f, 1.0f, 100.0f}) {
        for (const glm::vec3 towards : {glm::vec3(0.0f, 0.0f, 1.0f), glm::vec3(-0.5f, 0.3f, 1.0f)}) {
            const glm::vec3 at = distance * glm::normalize(towards);
            const ChangeAlong change = MovingViews(bsdf, glm::normalize(at), distance, kFrame).change(kIncoming);
            const glm::vec3 along_x = slope(bsdf, at, kFrame.x), along_y = slope(bsdf, at, kFrame.y);
            const float size = glm::length(along_x) + glm::length(along_y);
            EXPECT_GT(size * distance, 0.1f) << "else there is nothing to see";
            EXPECT_LT(glm::distance(change[0], along_x), 0.1f * size) << distance;
            EXPECT_LT(glm::distance(change[1], along_y), 0.1f * size) << distance;
        }
    }
}

TEST(MovingViews, OfSurfacesThatLookTheSameFromEverywhereDoNotChange)
{
    const Bsdf diffuse = test::surface_of({make_lobe<Diffuse>(glm::vec3(0.5f))});
    const Lobe layer = make_lobe<Specular>(glm::vec3(0.04f), 1.0f, 0.1f), light = make_lobe<Diffuse>(glm::vec3(0.5f));
    for (const Bsdf& bsdf : {diffuse, metal(0.4f), test::surface_of({layer, light})})
        for (const glm::vec3 along : MovingViews(bsdf, {0, 0, 1}, 1.0f, kFrame).change(kIncoming))
            EXPECT_EQ(along, glm::vec3(0.0f));
}

TEST(MovingViews, OfALayerAboveADarkSurfaceChange)
{
    const Lobe layer = make_lobe<Specular>(glm::vec3(0.04f), 1.0f, 0.3f), dark = make_lobe<Diffuse>(glm::vec3(0.02f));
    const ChangeAlong alone = MovingViews(test::surface_of({layer}), {0, 0, 1}, 1.0f, kFrame).change(kIncoming);
    const ChangeAlong above = MovingViews(test::surface_of({layer, dark}), {0, 0, 1}, 1.0f, kFrame).change(kIncoming);
    EXPECT_GT(std::abs(alone[0].g), 0.01f);
    EXPECT_NEAR(above[0].g, alone[0].g, 0.02f * std::abs(alone[0].g));
}

// A view from behind would be taken for one that sees nothing, and the edge for one that light goes out at.
TEST(MovingViews, BesideASilhouetteDoNotChange)
{
    const glm::vec3 grazing = glm::normalize(glm::vec3(1.0f, 0.0f, 0.05f));
    const Basis across({-1.0f, 0.0f, 0.0f});
    for (const glm::vec3 along : MovingViews(metal(0.2f), grazing, 1.0f, across).change(kIncoming))
        EXPECT_EQ(along, glm::vec3(0.0f));
}

TEST(MovingViews, OfAHitOnThePlaceItselfAreFinite)
{
    for (const float distance : {0.0f, 1e-44f, 1e-30f})
        for (const glm::vec3 along : MovingViews(metal(0.1f), {0, 0, 1}, distance, kFrame).change(kIncoming))
            for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(along[c])) << distance;
}

}  // namespace
}  // namespace rcs
