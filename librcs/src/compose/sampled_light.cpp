#include "compose/sampled_light.h"

#include <cmath>
#include <numbers>

#include "gbuffer/checked_pixels.h"
#include "util/color.h"

namespace rcs {
namespace {

/// What was sampled again in the pixel's square, if it was at this pixel; else null.
template <typename Again>
const Again* again_at(const std::vector<Again>& again, const GBuffer& g, std::size_t pixel)
{
    if (again.empty()) return nullptr;
    const Again& there = again[CheckedPixels(g.width, g.height, 0).square_of(pixel)];
    return there.pixel == pixel ? &there : nullptr;
}

void look_at_direct(const DirectLightResult& direct, const GBuffer& g, const Sample& s, SampledLight& sampled)
{
    const std::size_t i = s.pixel;
    const glm::vec3 reflectance = std::numbers::inv_pi_v<float> * sampled.diffuse_reflectance;
    SampledLight::OfKind& diffuse = sampled.kinds[SampledLight::diffuse];
    SampledLight::OfKind& highlights = sampled.kinds[SampledLight::highlights];
    diffuse.light = reflectance * direct.irradiance[i];
    if (!direct.irradiance_error.empty()) diffuse.error = luminance(reflectance) * direct.irradiance_error[i];
    if (!direct.in_part.empty()) diffuse.noisy = direct.in_part[i] != 0 ? 1.0f : 0.0f;
    if (!direct.glossy.empty()) highlights.light = s.share * direct.glossy[i];
    if (!direct.glossy_error.empty()) highlights.error = luminance(s.share) * direct.glossy_error[i];
    const DirectAgain* const again = again_at(direct.again, g, i);
    for (std::size_t k = 0; again && k < 2; ++k) {
        diffuse.again[k] = luminance(reflectance * again->irradiance[k]);
        highlights.again[k] = luminance(s.share * again->glossy[k]);
    }
}

void look_at_traced(const TracedLight& traced, const Shading& shading, const GBuffer& g, const Sample& s,
                    SampledLight& sampled)
{
    const std::size_t i = s.pixel;
    SampledLight::OfKind& highlights = sampled.kinds[SampledLight::highlights];
    SampledLight::OfKind& reflections = sampled.kinds[SampledLight::reflections];
    reflections.light = s.traced;
    reflections.error = s.traced_error;
    // Rays that agree may all have missed the same.
    reflections.noisy = shading.is_traced(i) ? 1.0f : 0.0f;
    if (!traced.of_lamps.empty()) {
        highlights.light += s.share * traced.of_lamps[i];
        highlights.error = std::hypot(highlights.error, luminance(s.share) * traced.of_lamps_error[i]);
    }
    const TracedAgain* const again = again_at(traced.again, g, i);
    for (std::size_t k = 0; again && k < 2; ++k) {
        reflections.again[k] = luminance(s.share * again->radiance[k]);
        highlights.again[k] += luminance(s.share * again->of_lamps[k]);
    }
}

}  // namespace

SampledLight look_at_sampled(const SamplePass& pass, const Shading& shading, const ShownLight& light, const Sample& s)
{
    SampledLight sampled;
    if (!s.covered) return sampled;
    const std::size_t i = s.pixel;
    sampled.diffuse_reflectance = s.share * pass.gbuffer.albedo[i];
    sampled.normal = luminance(s.share) * pass.gbuffer.normal(i);
    if (shading.has_lobes()) {
        const Bsdf bsdf = shading.bsdf(pass.gbuffer, i);
        const glm::vec3 outgoing = outgoing_at(pass.gbuffer, pass.view.camera, i);
        sampled.lobe_reflectance = s.share * albedo(bsdf, outgoing, glossy_lobes(bsdf));
    }
    if (!light.direct.irradiance.empty()) look_at_direct(light.direct, pass.gbuffer, s, sampled);
    if (!light.traced.radiance.empty()) look_at_traced(light.traced, shading, pass.gbuffer, s, sampled);
    return sampled;
}

}  // namespace rcs
