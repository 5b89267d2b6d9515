// What is met along narrow lobes: how its own lobes are evaluated.
#include "hit_light/hit_lobes.h"

#include <gtest/gtest.h>

#include "material/hand_over.h"
#include "support/lobes.h"

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

}  // namespace
}  // namespace rcs
