#include "hit_light/hit_lobes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lamps/power_heuristic.h"
#include "util/color.h"

namespace rcs {
namespace {

// Paths with more than this throughput all go on.
constexpr float kSurelyOn = 0.1f;

/// 1 up to the first width, 0 from the second on.
float share_below(float width, float all, float none)
{
    const float x = std::clamp((none - width) / (none - all), 0.0f, 1.0f);
    return x * x * (3.0f - 2.0f * x);
}

}  // namespace

HitLobes::HitLobes(const Bsdf& bsdf, glm::vec3 outgoing, float width, bool is_curved)
    : outgoing_(outgoing), diffuse_(rcs::albedo(bsdf, outgoing, diffuse_lobes(bsdf)))
{
    const LobeSet reflecting = reflecting_lobes(bsdf);
    const float wide =
        is_curved ? std::clamp(kHitWidening * width, kLeastEvaluatedAlpha, kNoRaysAlpha) : kLeastEvaluatedAlpha;
    for (std::uint32_t i = bsdf.count; i-- > 0;) {
        if ((reflecting >> i & 1u) == 0u) continue;
        Part& part = part_[count_++];
        part.exact = part.wide = bsdf.only(1u << i);
        part.wide.lobe[0] = widened(bsdf.lobe[i], wide);
        part.left = glm::vec3(1.0f);
        part.width = std::sqrt(width * width + bsdf.lobe[i].alpha * bsdf.lobe[i].alpha);
        part.lamps_share = share_below(part.width, kAllRaysAlpha, kNoRaysAlpha);
        part.share = share_below(part.width, kAllReflectedAlpha, kNoReflectedAlpha);
        const glm::vec3 left = left_below(bsdf, i, outgoing);
        for (int below = 0; below + 1 < count_; ++below) part_[below].left *= left;
    }
}

glm::vec3 HitLobes::evaluate(glm::vec3 incoming, float density) const
{
    glm::vec3 sum = std::numbers::inv_pi_v<float> * diffuse_;
    for (const Part& part : parts()) {
        const float share = density > 0.0f ? part.lamps_share : 0.0f;
        if (share < 1.0f) sum += (1.0f - share) * part.left * rcs::evaluate(part.wide, outgoing_, incoming);
        if (share > 0.0f)
            sum += share * power_heuristic(density, rcs::density(part.exact, outgoing_, incoming)) * part.left *
                   rcs::evaluate(part.exact, outgoing_, incoming);
    }
    return sum;
}

glm::vec3 HitLobes::albedo() const
{
    glm::vec3 sum = diffuse_;
    for (const Part& part : parts())
        if (part.share < 1.0f) sum += (1.0f - part.share) * part.left * rcs::albedo(part.wide, outgoing_, kAllLobes);
    return sum;
}

/// What its rays bring of a light that is the same from everywhere.
glm::vec3 HitLobes::ray_albedo(const Part& part, float share) const
{
    return share > 0.0f ? share * part.left * rcs::albedo(part.exact, outgoing_, kAllLobes) : glm::vec3(0.0f);
}

HitLobes::Onward HitLobes::sample(glm::vec3 throughput, bool only_lamps, RandomStream& random) const
{
    const auto share = [&](const Part& part) { return only_lamps ? part.lamps_share : part.share; };
    float by_lobe[kMostLobes];
    float sum = 0.0f;
    for (int i = 0; i < count_; ++i) sum += by_lobe[i] = luminance(throughput * ray_albedo(part_[i], share(part_[i])));
    if (!(sum > 0.0f)) return {};
    float choice = random.next() * sum;
    const float goes_on = std::min(sum / kSurelyOn, 1.0f);
    if (random.next() >= goes_on) return {};
    int picked = 0;
    for (int i = 0; i < count_; ++i) {
        if (!(by_lobe[i] > 0.0f)) continue;
        picked = i;
        if ((choice -= by_lobe[i]) < 0.0f) break;
    }
    const Part& part = part_[picked];
    const float u = random.next();
    const BsdfSample s = rcs::sample(part.exact, outgoing_, 0.5f, {u, random.next()});
    const float chance = goes_on * by_lobe[picked] / sum;
    return {s.incoming, s.weight * part.left * (share(part) / chance), part.lamps_share / share(part), part.width,
            s.density};
}

bool has_narrow_lobes(const Scene& scene)
{
    return std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) {
        return any_kind([&](auto kind) {
            const auto least = [](const TextureSlot& slot, int channel) { return any_channel(slot, channel).least; };
            return kind.may_be(m, any_channel) && kind.width(m, least) < kNoReflectedAlpha;
        });
    });
}

}  // namespace rcs
