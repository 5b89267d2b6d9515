#include "records/lamps_to_gather.h"

#include <numbers>
#include <vector>

#include "facts/scene_effects.h"
#include "gbuffer/visible_points.h"
#include "hit_light/hit_light.h"
#include "rays/ray_scene_impl.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr std::size_t kProbes = 256, kRays = 32;
// Of the hemisphere over visible points, cosine taken in, such a lamp would fill this part or more, were nothing in
// between. Smaller ones throw shadows that records would blur.
constexpr double kLeastSky = 0.1;
// Of its light so much arrives at the most. Where more does, 16 shadow rays a pixel show every shadow of it.
constexpr double kMostSeen = 0.3;

/// Light of one lamp, by its samples.
struct Arrival {
    std::uint32_t instance;
    float sky;              // part of the hemisphere
    float possible, found;  // luminance of irradiance
};

std::vector<Arrival> look_at_lamps(const RayScene& rays, const HitLights& lights, const SurfacePoint& point,
                                   RandomStream random)
{
    std::vector<Arrival> found;
    for (std::size_t k = 0; k < kRays; ++k) {
        const HitLights::Sample s = lights.sample(point, random);
        const std::size_t punctual = lights.lights().punctual.size();
        const std::vector<EmissiveTriangle>& triangles = lights.lights().triangles;
        if (!(luminance(s.irradiance) > 0.0f) || s.lamp < punctual || s.lamp - punctual >= triangles.size()) continue;
        const EmissiveTriangle& triangle = triangles[s.lamp - punctual];
        const float light = luminance(s.irradiance);
        found.push_back({triangle.instance, light / (std::numbers::pi_v<float> * luminance(triangle.radiance)), light,
                         occluded(rays, s.shadow_ray) ? 0.0f : light});
    }
    return found;
}

}  // namespace

GatheredLamps lamps_to_gather(const LitScene& scene, const GBuffer& gbuffer, const RecordSettings& settings,
                              ThreadPool& pool)
{
    const EffectSet effects = effects_or_scene(settings.effects, scene.rays);
    const HitLights lights(collect_lights(scene.rays, effects));
    if (lights.lights().triangles.empty()) return {};
    const std::vector<std::uint32_t> probes = spread_pixels(gbuffer, kProbes, settings.seed);
    std::vector<std::vector<Arrival>> found(probes.size());
    pool.parallel_for(probes.size(), 4, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k) {
            const RandomStream random(stream_key(settings.seed, Stream::lit_points, ~k));
            found[k] = look_at_lamps(scene.rays, lights, visible_point(gbuffer, probes[k]), random);
        }
    });
    struct Sum {
        double sky = 0.0, possible = 0.0, found = 0.0;
    };
    std::vector<Sum> sums(scene.rays.impl().instances.size());
    double lit = 0.0;  // probes that a lamp could light
    for (const std::vector<Arrival>& arrivals : found) {
        lit += arrivals.empty() ? 0.0 : 1.0;
        for (const Arrival& a : arrivals) {
            sums[a.instance].sky += static_cast<double>(a.sky);
            sums[a.instance].possible += static_cast<double>(a.possible);
            sums[a.instance].found += static_cast<double>(a.found);
        }
    }
    GatheredLamps result;
    result.by_direction = settings.radiance;
    result.along_lobes = effects.has(Effect::traced_lobes);
    result.of_instance.resize(sums.size());
    std::uint64_t id = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const Sum& s = sums[i];
        if (s.sky < kLeastSky * kRays * lit || !(s.found > 0.0) || s.found > kMostSeen * s.possible) continue;
        result.of_instance[i] = 1;
        id = mix64(id ^ (i + 1));
        result.id = static_cast<std::uint32_t>(id) | 1u;
    }
    return result;
}

std::vector<Record> of_gathered_lamps(const std::vector<Record>& records)
{
    std::vector<Record> result = records;
    for (Record& r : result) {
        const float all = luminance(r.irradiance), lamps = luminance(r.of_lamps);
        if (lamps > 0.0f) r.noise *= all / lamps;  // theirs, for all that is known
        for (int c = 0; c < 3; ++c) {
            const float part = r.irradiance[c] > 0.0f ? r.of_lamps[c] / r.irradiance[c] : 0.0f;
            r.rotation_gradient[static_cast<std::size_t>(c)] *= part;
            r.translation_gradient[static_cast<std::size_t>(c)] *= part;
        }
        r.irradiance = r.of_lamps;
        r.radiance = std::move(r.radiance_of_lamps);
    }
    return result;
}

}  // namespace rcs
