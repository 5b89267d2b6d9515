#include "render/past_light.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <utility>

#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Memory is for about so many pixels of all passes, but always for one pass [px].
constexpr std::size_t kMostPixels = std::size_t{1} << 22;
// What is darker than this part of the mean may be off by as much as if it were as bright: of all light, and of that of
// lamps alone, which pictures have as a layer.
constexpr float kDark = 0.05f, kLittle = 0.01f;

SampledWith sampled_with(const Frame& f)
{
    EffectSet effects = f.settings.effects;
    effects.set(Effect::emission, false);  // what is seen to shine does so on its own
    return {f.session.state().scene_number,
            f.gathered.id,
            effects,
            f.direct.area_samples,
            f.direct.penumbra_samples,
            f.direct.lamp_picks,
            f.settings.lobes.rays_per_pixel,
            f.settings.lobes.bounces};
}

float mean_of(const std::vector<float>& light)
{
    const double sum = std::accumulate(light.begin(), light.end(), 0.0);
    return static_cast<float>(sum / static_cast<double>(std::max<std::size_t>(1, light.size())));
}

/// Sets what says by how much the samples may be off.
void sum_up(const GBuffer& g, KeptSamples& kept)
{
    std::vector<float>& all = kept.all;
    all.assign(g.size(), 0.0f);
    const auto add = [&](const std::vector<glm::vec3>& light) {
        for (std::size_t i = 0; i < light.size(); ++i) all[i] += luminance(light[i]);
    };
    for (std::size_t i = 0; i < kept.direct.irradiance.size(); ++i)
        all[i] += std::numbers::inv_pi_v<float> * luminance(g.albedo[i] * kept.direct.irradiance[i]);
    add(kept.direct.glossy);
    kept.little_direct = kLittle * mean_of(all);
    add(kept.traced.radiance);
    add(kept.traced.of_lamps);
    const float dark = kDark * mean_of(all);
    for (float& light : all) light += dark;
}

}  // namespace

bool goes_on(const Frame& f)
{
    return f.session.state().options.keep_records && f.layer == 0 && !f.moments && !f.is_glance && !has_goal(f.asked);
}

void look_back(Frame& f)
{
    f.past.reset();
    Session::State& session = f.session.state();
    const auto pass = static_cast<std::size_t>(f.pass);
    if (!goes_on(f) || pass >= session.samples.size() || session.samples[pass].with != sampled_with(f)) return;
    const KeptSamples& kept = session.samples[pass];
    const bool is_still = kept.seed == f.settings.seed && kept.points.view == f.view();
    if (is_still && kept.moved.empty() && kept.points.instance == f.gbuffer.instance) {
        // A filter is told by samples beside the pixels'.
        if (!f.direct.checked) f.past.emplace(PastSamples{kept, std::nullopt, 0, 0, true});
        return;
    }
    f.past.emplace(timed(f, "gbuffer", [&] {
        return PastSamples{kept, PastPlaces(kept.points, f.gbuffer, f.view(), f.shading, f.session.pool()),
                           is_still ? session.sampled : ++session.sampled, kept.views + pass, is_still};
    }));
    // Else views would go on from the same samples. What stands still is not to flicker.
    if (!is_still) f.direct.seed = stream_key(f.direct.seed, Stream::views, f.past->number);
}

void keep_samples(Frame& f)
{
    if (!goes_on(f) || (f.past && !f.past->places)) return;
    std::vector<KeptSamples>& samples = f.session.state().samples;
    const auto pass = static_cast<std::size_t>(f.pass);
    if (pass == 0 && !samples.empty() && samples.front().with != sampled_with(f)) samples.clear();
    KeptSamples kept;
    if (f.settings.has_lamps && averages_direct_light(f.rays, f.direct)) kept.direct = f.light.direct;
    kept.traced = f.light.traced;
    if (TracedLight::Apart& apart = kept.traced.apart; !apart.radiance.empty()) {
        kept.traced.radiance = std::move(apart.radiance), kept.traced.error = std::move(apart.error);
        kept.traced.of_lamps = std::move(apart.of_lamps), kept.traced.of_lamps_error = std::move(apart.of_lamps_error);
        apart = {};
    }
    kept.direct.again.clear();
    kept.direct.apart = {};
    kept.traced.again.clear();
    const bool knows = !kept.direct.irradiance.empty() || !kept.traced.radiance.empty();
    if (!knows || pass > samples.size() || (pass > 0 && (pass + 1) * f.gbuffer.size() > kMostPixels)) return;
    sum_up(f.gbuffer, kept);
    kept.points = points_of(f.gbuffer, f.view());
    kept.with = sampled_with(f);
    kept.seed = f.settings.seed;
    kept.views = f.past ? f.past->kept.views + 1 : 0;
    if (pass == samples.size()) samples.emplace_back();
    samples[pass] = std::move(kept);
}

}  // namespace rcs
