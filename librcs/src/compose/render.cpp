#include "rcs/render.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <string>

#include "accuracy/error_estimate.h"
#include "compose/compose.h"
#include "compose/effect_counts.h"
#include "compose/goal.h"
#include "compose/settings.h"
#include "compose/shared_samples.h"
#include "gbuffer/shading.h"
#include "gbuffer/views.h"
#include "glossy/traced_lobes.h"
#include "hit_light/hit_lobes.h"
#include "placement/view_fit.h"
#include "plan/plan_words.h"
#include "rcs/error.h"
#include "rcs/version.h"

namespace rcs {
namespace {

// Behind up to so many surfaces with narrow lobes the light cache knows how many bounces are left; further on, about.
constexpr int kKeptFewer = 8;

// Behind so many transparent surfaces nothing more is looked for.
constexpr int kMostLayers = 16;
// ... nor where less than this part of the light comes through: half a code of an 8-bit picture.
constexpr float kLeastWeight = 1.0f / 512.0f;

/// Takes the weights on through the surfaces just shaded. @return whether anything behind them matters
bool look_behind(const Shading& shading, std::vector<glm::vec3>& weight)
{
    if (shading.through.empty()) return false;
    if (weight.empty()) weight.assign(shading.through.size(), glm::vec3(1.0f));
    bool any = false;
    for (std::size_t i = 0; i < weight.size(); ++i) {
        weight[i] *= shading.through[i];
        if (std::max({weight[i].r, weight[i].g, weight[i].b}) < kLeastWeight)
            weight[i] = glm::vec3(0.0f);
        else
            any = true;
    }
    return any;
}

/// Adds the wall time of a stage to the statistics.
class StageClock {
public:
    StageClock(RenderStats& stats, const ProgressFunction& progress) : stats_(stats), progress_(progress) {}

    template <typename Work>
    auto run(const char* stage, const Work& work)
    {
        if (progress_ && !progress_(stage, 0.0f))
            throw Error(ErrorCode::cancelled, std::string("cancelled before stage ") + stage);
        const Stop stop{*this, stage, std::chrono::steady_clock::now()};
        return work();
    }

private:
    struct Stop {
        StageClock& clock;
        const char* stage;
        std::chrono::steady_clock::time_point start;
        ~Stop()
        {
            const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
            clock.stats_.add(stage, spent.count());
        }
    };
    RenderStats& stats_;
    const ProgressFunction& progress_;
};

/// Takes out the records without radiance, which are no use to glossy surfaces but to other views.
std::vector<Record> take_plain(std::vector<Record>& records)
{
    const auto plain =
        std::stable_partition(records.begin(), records.end(), [](const Record& r) { return !r.radiance.empty(); });
    std::vector<Record> taken(std::make_move_iterator(plain), std::make_move_iterator(records.end()));
    records.erase(plain, records.end());
    return taken;
}

/// Rays of a pixel, of which each pass shoots its part.
int of_pass(int rays, int passes) { return (rays + passes - 1) / passes; }

SplatMethod choose_method(SplatMethod wanted, const GlContext& gl)
{
    if (wanted != SplatMethod::automatic) return wanted;
    return gl.software() ? SplatMethod::tiles : SplatMethod::quads;
}

// Beyond so many times the target a render says that it did not get there: the estimate itself scatters by as much.
constexpr double kNotReached = 1.05;

std::string percent(double part)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g %%", 100.0 * part);
    return text;
}

/// @param records, passes  as they were, which with a target or a budget is not what the options say
void describe(const RenderOptions& o, const RecordSettings& records, int passes, const Camera& camera,
              const RenderStats& stats, LayeredImage& image)
{
    image.metadata["rcs:effects"] = list_effects(stats.plan, true);
    image.metadata["rcs:effects-left-out"] = list_effects(stats.plan, false);
    const auto number = [](auto value) { return std::to_string(value); };
    image.metadata["rcs:version"] = kVersion;
    image.metadata["rcs:camera"] = camera.name;
    image.metadata["rcs:accuracy"] = number(records.error_tolerance);
    image.metadata["rcs:rays"] = number(records.rays);
    image.metadata["rcs:noise"] = number(records.noise_target);
    image.metadata["rcs:bounces"] = number(o.bounces);
    image.metadata["rcs:aa"] = number(passes);
    if (target_error(o) > 0.0) image.metadata["rcs:target-error"] = number(target_error(o));
    if (budget_seconds(o) > 0.0) image.metadata["rcs:budget"] = number(budget_seconds(o));
    image.metadata["rcs:lobe-rays"] = number(o.lobe_rays);
    image.metadata["rcs:overlap"] = number(o.overlap);
    image.metadata["rcs:seed"] = number(o.seed);
    image.metadata["rcs:splat"] = stats.splat_method;
    image.metadata["rcs:error-mean"] = number(stats.error.mean_relative);
    image.metadata["rcs:error-median"] = number(stats.error.median_relative);
    image.metadata["rcs:error-p95"] = number(stats.error.p95_relative);
    image.metadata["rcs:renderer"] = stats.gl_renderer;
}

}  // namespace

void RenderStats::add(const std::string& stage, double seconds)
{
    const auto found = std::find_if(stage_seconds.begin(), stage_seconds.end(),
                                    [&](const auto& entry) { return entry.first == stage; });
    if (found == stage_seconds.end())
        stage_seconds.emplace_back(stage, seconds);
    else
        found->second += seconds;
}

RenderResult render(GlContext& gl, const RayScene& rays, const Camera& camera, const RenderOptions& wanted,
                    ThreadPool& pool, std::vector<Record> cache, const LogFunction& log,
                    const ProgressFunction& progress, const ForecastFunction& forecast, const PassFunction& after_pass)
{
    validate(wanted);
    RenderResult result;
    RenderStats& stats = result.stats;
    EffectCounts& counts = stats.counts;
    const EffectTally tally(gl);
    StageClock clock(stats, progress);
    stats.plan = clock.run("plan", [&] { return plan_effects(rays, camera, wanted); });
    const EffectPlan& plan = stats.plan;
    tell(plan, log);
    const EffectSet effects = plan.set();
    const PictureLayers layers = picture_layers(plan, rays.scene(), wanted.motion);
    RenderOptions options = wanted;
    options.aa = plan.passes;
    options.bounces = plan.bounces;

    Goal goal(options);
    stats.threads = pool.size();
    stats.gl_renderer = gl.renderer();
    stats.gl_version = gl.version();
    stats.gl_platform = gl.platform();
    const SplatMethod method = choose_method(options.splat, gl);
    stats.splat_method = method == SplatMethod::quads ? "quads" : "tiles";
    RecordSettings record_options = record_settings(options);
    record_options.radiance = plan.needs(Effect::glossy_records);
    record_options.effects = effects;
    DirectSettings direct_options = direct_settings(options);
    direct_options.area_samples = of_pass(options.area_samples, options.aa);
    direct_options.penumbra_samples = of_pass(options.penumbra_samples, options.aa);
    direct_options.effects = effects;
    const int lobe_rays = goal.rays_of_round(of_pass(options.lobe_rays, options.aa));
    SplatSettings wide{record_options.error_tolerance, options.overlap, plan.needs(Effect::error_estimate)};
    const bool has_lamps =
        plan.needs(Effect::punctual_light) || plan.needs(Effect::area_light) || plan.needs(Effect::environment_peaks);
    const bool has_records = plan.needs(Effect::indirect_diffuse), has_traced = plan.needs(Effect::traced_lobes);
    if (options.dry_run && !has_records) return result;  // nothing to forecast

    const std::vector<View> views = make_views(camera, options.width, options.height, options.aa);
    const float texture_scale = 1.0f / std::sqrt(static_cast<float>(options.aa));
    std::vector<Record> records = std::move(cache);
    const std::vector<Record> without_radiance = record_options.radiance ? take_plain(records) : std::vector<Record>{};
    std::optional<LightCache> light_cache;
    int lobe_rounds = 1;                  // of tracing, in each pass
    std::optional<SharedSamples> shared;  // by passes after the first
    for (int pass = 0; goal.wants_pass(pass); ++pass) {
        const View& view = views[static_cast<std::size_t>(pass)];
        direct_options.seed = pass_seed(options.seed, pass);
        Shading shading;
        GBuffer gbuffer = clock.run("gbuffer", [&] {
            return render_gbuffer(gl, rays, view, texture_scale, pool, effects, shading,
                                  shared ? &shared->known : nullptr);
        });
        ++counts.gbuffers;
        note_bytes(shading, counts);
        if (plan.needs(Effect::more_bounces) && !light_cache) {
            light_cache = clock.run("bounces", [&] {
                LightCacheSettings cache_options{
                    .bounces = options.bounces - 1, .seed = options.seed, .effects = effects};
                if (has_narrow_lobes(rays.scene()))
                    cache_options.kept_fewer = std::min(cache_options.bounces - 1, kKeptFewer);
                return build_light_cache(rays, gbuffer, view, cache_options, pool, stats.light_cache, progress);
            });
        }
        const LightCache* const bounced = light_cache ? &*light_cache : nullptr;
        std::vector<glm::vec3> weight;  // of the surfaces behind transparent ones
        for (int layer = 0; layer < kMostLayers; ++layer) {
            PassLight light;
            light.layers = &layers;
            const FirstView first{gbuffer, view, shading, light, record_options.radiance};
            const bool is_first = pass == 0 && layer == 0;
            if (has_lamps) {
                if (is_first) direct_options = goal.afford(rays, first, direct_options, pool);
                light.direct = clock.run("direct", [&] {
                    return direct_light(rays, gbuffer, view, shading, direct_options, pool, stats.direct_shadow_rays);
                });
                ++counts.direct_passes;
            }
            const auto trace = [&](int round) {
                ++counts.lobe_passes;
                return clock.run("glossy", [&] {
                    const std::uint64_t seed =
                        stream_key(direct_options.seed, Stream::glossy, static_cast<std::uint64_t>(round));
                    return trace_lobes(rays, {rays, bounced, effects}, gbuffer, view, shading,
                                       {lobe_rays, options.bounces, seed}, pool, stats.traced);
                });
            };
            if (has_traced) light.traced = trace(0);
            if (has_records) {
                // Records of earlier passes are shared; this one adds where it sees what they did not.
                clock.run("records", [&] {
                    if (is_first) fit_to_view(gbuffer, view, records);
                    if (goal.is_set() && is_first)
                        goal.place(rays, first, pool, bounced, record_options, records, stats, progress, forecast);
                    else
                        place_records(rays, gbuffer, view, record_options, pool, records, stats.records, progress,
                                      bounced);
                });
                if (goal.stopped()) return result;
                wide.error_tolerance = record_options.error_tolerance;
                const Shading* const glossy = record_options.radiance ? &shading : nullptr;
                SplatStats splats;
                light.indirect = clock.run("splat", [&] {
                    return method == SplatMethod::quads
                               ? splat_quads(gl, records, gbuffer, view, wide, splats, glossy)
                               : splat_tiles(records, gbuffer, view, wide, pool, splats, glossy);
                });
                ++(glossy ? counts.glossy_splats : counts.splats);
                stats.splats.splats += splats.splats;
                stats.splats.samples += splats.samples;
                if (wide.error_sums) {
                    light.indirect_error =
                        clock.run("error", [&] { return error_map(light.indirect, splats, options.overlap); });
                    ++counts.error_passes;
                }
            }
            lobe_rounds = std::max(lobe_rounds, goal.lobe_rounds());
            for (int round = 1;
                 has_traced && (round < lobe_rounds || (is_first && goal.wants_more_lobes(first, round))); ++round) {
                add_round(light.traced, trace(round), round);
                lobe_rounds = std::max(lobe_rounds, round + 1);
            }
            clock.run("compose", [&] {
                stats.unserved_pixels += accumulate_pass(gbuffer, view, shading, light, weight,
                                                         shared ? &shared->known : nullptr, result.image);
                if (shared)
                    counts.shared_samples += add_shared(*shared, result.image);
                else if (is_first && plan.shares_samples)
                    shared = find_smooth(gbuffer, light.direct, result.image, pool);
            });
            if (!look_behind(shading, weight)) break;
            clock.run("gbuffer", [&] { peel_gbuffer(rays, view, texture_scale, pool, weight, gbuffer, shading); });
            ++counts.peeled_layers;
        }
        if (after_pass && pass + 1 < goal.passes()) {
            after_pass(pass + 1, goal.passes(), [&] {
                LayeredImage so_far = result.image;
                finish_passes(pass + 1, so_far);
                return so_far;
            });
        }
    }
    clock.run("compose", [&] { finish_passes(goal.passes(), result.image); });
    if (plan.needs(Effect::error_estimate))
        stats.error = clock.run("error", [&] { return estimate_error(result.image); });
    keep_layers(layers, result.image);
    tally.finish(gl, records, result.image, counts);
    describe(options, record_options, goal.passes(), camera, stats, result.image);
    result.image.metadata["rcs:records"] = std::to_string(records.size());
    if (log && stats.error.mean_relative > kNotReached * target_error(options) && target_error(options) > 0.0)
        log(LogLevel::warning, "the error of indirect light is estimated as " + percent(stats.error.mean_relative) +
                                   ", not the " + percent(target_error(options)) + " wanted");
    if (stats.unserved_pixels > 0 && log)
        log(LogLevel::warning, std::to_string(stats.unserved_pixels) + " visible pixels are served by no record");
    result.records = std::move(records);
    result.records.insert(result.records.end(), without_radiance.begin(), without_radiance.end());
    return result;
}

}  // namespace rcs
