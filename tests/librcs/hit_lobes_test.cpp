// What is met along narrow lobes: how its own lobes are evaluated.
#include "hit_light/hit_lobes.h"

#include <gtest/gtest.h>

#include "material/hand_over.h"
#include "support/lobes.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr float kAlpha = 0.2f, kSeenThrough = 0.3f;  // so wide together that none goes on as rays
const glm::vec3 kOutgoing = glm::normalize(glm::vec3(-0.4f, 0.2f, 1.0f));
const glm::vec3 kMirrored = glm::normalize(glm::vec3(0.4f, -0.2f, 1.0f));

Bsdf metal(float alpha) { return test::surface_of({make_lobe<Specular>(glm::vec3(0.9f, 0.7f, 0.3f), 1.0f, alpha)}); }

glm::vec3 evaluated(const Bsdf& bsdf, bool is_curved)
{
    return HitLobes(bsdf, kOutgoing, kSeenThrough, is_curved).evaluate(kMirrored, 0.0f);
}

TEST(HitLobes, OfFlatFacesStayAsTheyAre)
{
    const glm::vec3 exact = evaluate(metal(kAlpha), kOutgoing, kMirrored);
    EXPECT_NEAR(evaluated(metal(kAlpha), false).r / exact.r, 1.0f, 1e-5f);
}

TEST(HitLobes, OfCurvedFacesAreWidened)
{
    const glm::vec3 exact = evaluate(metal(kAlpha), kOutgoing, kMirrored);
    EXPECT_LT(evaluated(metal(kAlpha), true).r, 0.7f * exact.r);
}

TEST(HitLobes, OfMirrorsHideSpots)
{
    const glm::vec3 mirror = evaluate(metal(kLeastAlpha), kOutgoing, kMirrored);
    const glm::vec3 least = evaluate(metal(kLeastEvaluatedAlpha), kOutgoing, kMirrored);
    EXPECT_LT(evaluated(metal(kLeastAlpha), false).r, 2.0f * least.r);
    EXPECT_GT(mirror.r, 100.0f * least.r);
}

// Far beside the mirror direction a lobe's light grows as the square of its width: widened as a whole, a curved metal
// would light up what hardly anything comes to.
TEST(HitLobes, OfCurvedFacesKeepTheirTails)
{
    const glm::vec3 beside = glm::normalize(glm::vec3(-0.9f, 0.4f, 0.2f));
    const glm::vec3 exact = evaluate(metal(0.05f), kOutgoing, beside);
    EXPECT_NEAR(HitLobes(metal(0.05f), kOutgoing, kSeenThrough, true).evaluate(beside, 0.0f).r / exact.r, 1.0f, 1e-4f);
}

// Rays that look for lamps would find them as dots; what surfaces reflect makes none.
TEST(HitLobes, GoOnForWhatSurfacesReflectWhereLampsAreEvaluated)
{
    const HitLobes lobes(metal(kAlpha), kOutgoing, 0.3f, false);
    RandomStream random(1);
    EXPECT_EQ(lobes.sample(glm::vec3(1.0f), true, random).weight, glm::vec3(0.0f));
    glm::vec3 sum(0.0f);
    constexpr int kSamples = 20000;
    for (int i = 0; i < kSamples; ++i) {
        const HitLobes::Onward onward = lobes.sample(glm::vec3(1.0f), false, random);
        EXPECT_EQ(onward.of_lamps * luminance(onward.weight), 0.0f);
        sum += onward.weight / static_cast<float>(kSamples);
    }
    // In a light that is the same from everywhere both ways add up to all that is reflected.
    const glm::vec3 all = albedo(metal(kAlpha), kOutgoing, kAllLobes);
    EXPECT_GT(sum.r, 0.5f * all.r);
    EXPECT_NEAR((sum + lobes.albedo()).r / all.r, 1.0f, 0.01f);
}

}  // namespace
}  // namespace rcs
