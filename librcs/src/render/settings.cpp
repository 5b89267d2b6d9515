#include "render/settings.h"

#include <algorithm>
#include <cmath>

#include "hit_light/hit_lobes.h"

namespace rcs {

RecordSettings record_settings(const RenderOptions& o)
{
    const QualitySettings quality = settings_or_default(o);
    return {.error_tolerance = quality.error_tolerance,
            .rays = quality.rays,
            .noise_target = quality.noise_target,
            .refinement = quality.refinement,
            .min_reach = o.min_reach,
            .max_reach = o.max_reach,
            .gradient_limit = o.gradient_limit,
            .bounces = o.bounces,
            .seed = o.seed};
}

namespace {

// Behind up to so many surfaces with narrow lobes the light cache knows how many bounces are left; further on, about.
constexpr int kKeptFewer = 8;

DirectSettings direct_settings(const RenderOptions& o)
{
    return {.area_samples = o.area_samples,
            .penumbra_samples = std::max(o.penumbra_samples, o.area_samples),
            .lamp_picks = o.lamp_picks,
            .seed = o.seed};
}

/// Rays of a pixel, of which each pass shoots its part.
int of_pass(int rays, int passes) { return (rays + passes - 1) / passes; }

/// Of one round: with a goal few, so that there can be as many rounds as it takes.
int rays_of_round(int rays, const Quality& quality)
{
    if (std::holds_alternative<QualitySettings>(quality)) return rays;
    return std::max(1, std::holds_alternative<Budget>(quality) ? rays / 8 : rays / 2);
}

}  // namespace

Settings make_settings(const RenderOptions& asked, const EffectPlan& plan, const Scene& scene)
{
    Settings s;
    s.effects = plan.set();
    s.quality = asked.quality;
    s.seed = asked.seed;
    s.passes = plan.passes;
    s.shares_samples = plan.shares_samples;
    s.texture_scale = 1.0f / std::sqrt(static_cast<float>(plan.passes));
    s.has_lamps = s.needs(Effect::punctual_light) || s.needs(Effect::area_light) || s.needs(Effect::environment_peaks);
    s.light_cache = {.bounces = plan.bounces - 1, .seed = asked.seed, .effects = s.effects};
    if (has_narrow_lobes(scene)) s.light_cache.kept_fewer = std::min(plan.bounces - 2, kKeptFewer);
    s.direct = direct_settings(asked);
    s.direct.area_samples = of_pass(s.direct.area_samples, plan.passes);
    s.direct.penumbra_samples = of_pass(s.direct.penumbra_samples, plan.passes);
    s.direct.effects = s.effects;
    const bool filters = asked.denoise != Denoiser::none;
    s.direct.error = s.needs(Effect::error_estimate) || filters;
    if (filters) s.direct.checked = asked.seed;
    s.direct.together = !filters;  // filters know noise of each pixel's own
    s.lobes = {.rays_per_pixel = rays_of_round(of_pass(asked.lobe_rays, plan.passes), asked.quality),
               .bounces = plan.bounces,
               .checked = s.direct.checked};
    s.records = record_settings(asked);
    s.records.bounces = plan.bounces;
    s.records.radiance = s.needs(Effect::glossy_records);
    s.records.effects = s.effects;
    s.splat = {s.records.error_tolerance, asked.overlap, s.needs(Effect::error_estimate)};
    return s;
}

}  // namespace rcs
