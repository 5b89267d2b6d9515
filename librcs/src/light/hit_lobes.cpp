#include "light/hit_lobes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "light/power_heuristic.h"
#include "util/color.h"

namespace rcs {
namespace {

// Lobes together narrower than the first go on as rays, wider than the second none does: there records take over, whose
// hits are all evaluated (kLeastRecordAlpha).
constexpr float kAllRays = 0.15f, kNoRays = HitRadiance::kLeastAlpha;

// A lobe is evaluated at least so many times as wide as those it is seen through, ...
constexpr float kWidening = 2.0f;
// ... and at least so wide: lamps without extent show in it as spots that a picture can hold.
constexpr float kLeastEvaluated = 0.05f;

// Paths with more than this throughput all go on.
constexpr float kSurelyOn = 0.1f;

float share_of_rays(float width)
{
    const float x = std::clamp((kNoRays - width) / (kNoRays - kAllRays), 0.0f, 1.0f);
    return x * x * (3.0f - 2.0f * x);
}

}  // namespace

HitLobes::HitLobes(const Bsdf& bsdf, glm::vec3 outgoing, float width)
    : outgoing_(outgoing), cosine_(glm::dot(bsdf.normal, outgoing)), diffuse_(diffuse_albedo(bsdf, cosine_))
{
    Bsdf alone = bsdf;
    alone.diffuse = alone.transmission = glm::vec3(0.0f);
    if (bsdf.has_coat()) {
        Bsdf coat = alone;
        coat.f0 = glm::vec3(0.0f);
        coat.f90 = 0.0f;
        coat.alpha = bsdf.coat_alpha;
        coat_ = make_part(coat, width);
        specular_.left = 1.0f - specular_albedo(coat, cosine_);
    }
    if (bsdf.has_specular()) {
        const glm::vec3 left = specular_.left;
        alone.coat = 0.0f;
        specular_ = make_part(alone, width);
        specular_.left = left;
    }
}

/// The coat's own width is in both of its widths.
HitLobes::Part HitLobes::make_part(const Bsdf& alone, float width) const
{
    Part part;
    part.present = true;
    part.exact = part.wide = alone;
    part.wide.alpha = std::max(alone.alpha, std::clamp(kWidening * width, kLeastEvaluated, HitRadiance::kLeastAlpha));
    part.wide.coat_alpha = part.wide.alpha;
    part.width = std::sqrt(width * width + alone.alpha * alone.alpha);
    part.share = share_of_rays(part.width);
    return part;
}

glm::vec3 HitLobes::evaluate(glm::vec3 incoming, float density) const
{
    glm::vec3 sum = std::numbers::inv_pi_v<float> * diffuse_;
    for (const Part* part : {&specular_, &coat_}) {
        if (!part->present) continue;
        const float share = density > 0.0f ? part->share : 0.0f;
        if (share < 1.0f) sum += (1.0f - share) * part->left * evaluate_glossy(part->wide, outgoing_, incoming);
        if (share > 0.0f)
            sum += share * power_heuristic(density, glossy_density(part->exact, outgoing_, incoming)) * part->left *
                   evaluate_glossy(part->exact, outgoing_, incoming);
    }
    return sum;
}

glm::vec3 HitLobes::albedo() const
{
    glm::vec3 sum = diffuse_;
    for (const Part* part : {&specular_, &coat_})
        if (part->present && part->share < 1.0f)
            sum += (1.0f - part->share) * part->left * specular_albedo(part->wide, cosine_);
    return sum;
}

/// What its rays bring of a light that is the same from everywhere.
glm::vec3 HitLobes::ray_albedo(const Part& part) const
{
    return part.present && part.share > 0.0f ? part.share * part.left * specular_albedo(part.exact, cosine_)
                                             : glm::vec3(0.0f);
}

HitLobes::Onward HitLobes::sample(glm::vec3 throughput, RandomStream& random) const
{
    const float by_specular = luminance(throughput * ray_albedo(specular_)),
                by_coat = luminance(throughput * ray_albedo(coat_));
    const float sum = by_specular + by_coat;
    if (!(sum > 0.0f)) return {};
    const float choice = random.next() * sum, goes_on = std::min(sum / kSurelyOn, 1.0f);
    if (random.next() >= goes_on) return {};
    const bool is_specular = choice < by_specular;
    const Part& part = is_specular ? specular_ : coat_;
    const float u = random.next();
    const BsdfSample s = sample_glossy(part.exact, outgoing_, 0.5f, {u, random.next()});
    const float chance = goes_on * (is_specular ? by_specular : by_coat) / sum;
    return {s.incoming, s.weight * part.left * (part.share / chance), part.width, s.density};
}

bool has_narrow_lobes(const Scene& scene)
{
    return std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) {
        // Textures can only make a surface smoother than its factor says.
        return !is_lambertian(m) &&
               (m.clearcoat > 0.0f || m.metallic_roughness_texture.used() || m.roughness * m.roughness < kNoRays);
    });
}

}  // namespace rcs
