#include "material/moving_views.h"

#include <algorithm>
#include <cstddef>
#include <numbers>

#include "material/hand_over.h"
#include "util/color.h"

namespace rcs {
namespace {

// As far as views turn where a record of a = .2 ends that sees a surface at its mean distance, half to each side. What
// a chord so long says is what the record will be taken for: of lobes narrower than that a tangent is mostly noise.
constexpr float kTurn = 0.1f;
// A hit may lie on the place itself, as far as floats tell.
constexpr float kLeastDistance = 1e-30f;

// Over what diffuse lobes reflect, what narrow ones must to count: below a dielectric's on a light wall, gradients are
// off by less than other things are, and sibenik/nave took 8 % longer for nothing.
constexpr float kLeastShare = 0.25f;

bool looks_different_from_beside(const Bsdf& bsdf)
{
    float narrow = 0.0f, diffuse = 0.0f;
    for (const Lobe& lobe : bsdf) {
        if (is_diffuse(lobe))
            diffuse += luminance(lobe.color);
        else if (!transmits(lobe) && lobe.alpha < kLikeDiffuseAlpha)
            narrow += luminance(lobe.color);
    }
    return narrow > kLeastShare * diffuse;
}

bool is_seen(const Bsdf& bsdf, glm::vec3 outgoing)
{
    return glm::dot(outgoing, bsdf.normal) > 0.0f && glm::dot(outgoing, bsdf.geometric_normal) > 0.0f;
}

}  // namespace

MovingViews::MovingViews(const Bsdf& bsdf, glm::vec3 outgoing, float distance, const Basis& frame) : bsdf_(bsdf)
{
    if (!looks_different_from_beside(bsdf)) return;
    const glm::vec3 ways[2] = {kTurn * frame.x, kTurn * frame.y};
    for (int k = 0; k < 2; ++k) {
        ahead_[k] = glm::normalize(outgoing + ways[k]);
        back_[k] = glm::normalize(outgoing - ways[k]);
        // Beside a silhouette there is nothing to see: that its edge moves, walls between cells tell.
        if (!is_seen(bsdf, ahead_[k]) || !is_seen(bsdf, back_[k])) return;
    }
    scale_ = 0.5f * std::numbers::pi_v<float> / (kTurn * std::max(distance, kLeastDistance));
}

ChangeAlong MovingViews::change(glm::vec3 incoming) const
{
    ChangeAlong change{};
    if (scale_ == 0.0f) return change;
    for (std::size_t k = 0; k < 2; ++k)
        change[k] = scale_ * (evaluate(bsdf_, ahead_[k], incoming) - evaluate(bsdf_, back_[k], incoming));
    return change;
}

}  // namespace rcs
