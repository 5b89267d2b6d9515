#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "accuracy/error_estimate.h"
#include "placement/hasty.h"
#include "rcs/render.h"
#include "render/frame.h"
#include "render/light_search.h"

namespace rcs {
namespace {

/// One quick pass of what is asked for.
RenderOptions hasty(const RenderOptions& asked, const Haste& haste)
{
    RenderOptions options = asked;
    options.aa = options.lobe_rays = 1;
    options.area_samples = std::min(asked.area_samples, haste.area_samples);
    options.penumbra_samples = std::min(asked.penumbra_samples, haste.area_samples);
    if (options.lamp_picks == 0 || options.lamp_picks > haste.lamp_picks) options.lamp_picks = haste.lamp_picks;
    options.denoise = Denoiser::none;
    options.f_stop = options.focus = std::nullopt;
    return options;
}

/// Light of later bounces as it is there, if only of another view. @return whether it is of this one
bool use_known_bounces(Frame& f)
{
    if (!f.needs(Effect::more_bounces)) return true;
    const Session::State& session = f.session.state();
    if (!session.light_cache) return false;
    f.light_cache = &*session.light_cache;
    return session.light_cache_use == LightCacheUse{f.view(), f.settings.light_cache};
}

void add(SplatBuffer& sums, const SplatBuffer& more, ThreadPool& pool)
{
    const auto add_up = [&](std::vector<float>& to, const std::vector<float>& from, float scale) {
        pool.parallel_for(to.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t i = begin; i < end; ++i) to[i] += scale * from[i];
        });
    };
    for (const auto member :
         {&SplatBuffer::weighted_r, &SplatBuffer::weighted_g, &SplatBuffer::weighted_b, &SplatBuffer::weight,
          &SplatBuffer::count, &SplatBuffer::glossy_r, &SplatBuffer::glossy_g, &SplatBuffer::glossy_b})
        add_up(sums.*member, more.*member, 1.0f);
    const float ratio = more.luminance_unit / sums.luminance_unit;
    for (const auto member : {&SplatBuffer::squares, &SplatBuffer::variance, &SplatBuffer::variance_of_sum})
        add_up(sums.*member, more.*member, ratio * ratio);
}

/// Where no record reaches.
std::vector<Record> gather_hastily(Frame& f, double seconds, const SplatBuffer& sums)
{
    const SplatSettings splat{f.course.records.error_tolerance, f.settings.splat.overlap, false};
    std::vector<float> weight = sums.weight;
    return timed(f, "records", [&] {
        return gather_in_haste({f.lit(), f.gbuffer, f.view(), f.course.records, splat}, seconds, f.session.pool(),
                               weight, f.stats().records);
    });
}

/// @param seconds  for new records; 0: there are to be none
void light_by_records(Frame& f, double seconds)
{
    if (!f.needs(Effect::indirect_diffuse)) return;
    correct_records(f);
    RecordedLight light = splat_light(f, f.records);
    if (seconds > 0.0) {
        std::vector<Record> fresh = gather_hastily(f, seconds, light.all);
        if (!fresh.empty()) {
            const RecordedLight more = splat_light(f, fresh);
            if (f.records.empty()) light.all.luminance_unit = more.all.luminance_unit;
            add(light.all, more.all, f.session.pool());
            if (light.of_lamps.width != 0) add(light.of_lamps, more.of_lamps, f.session.pool());
            light.stats.splats += more.stats.splats;
            light.stats.samples += more.stats.samples;
            f.records.insert(f.records.end(), std::make_move_iterator(fresh.begin()),
                             std::make_move_iterator(fresh.end()));
        }
    }
    f.light.indirect = std::move(light.all);
    f.light.of_lamps = std::move(light.of_lamps);
    rcs::ask_contacts(f);
    ErrorMap& errors = f.light.indirect_error;
    if (f.settings.splat.error_sums) {
        errors = timed(f, "estimate", [&] {
            return error_map(f.light.indirect, light.stats, f.settings.splat.overlap, f.session.pool());
        });
        scale(errors, f.error_scale, f.session.pool());
    }
    const std::vector<std::uint32_t> holes = fill_from_around(f.gbuffer, f.light.indirect);
    if (f.light.of_lamps.width != 0) fill_from_around(f.gbuffer, f.light.of_lamps);
    f.stats().unserved_pixels += holes.size();
    if (!errors.noise.empty())
        for (const std::uint32_t i : holes) errors.noise[i] = 1.0f;  // nothing is known of it
}

void put_back(Frame& f, std::optional<KeptGuide> guide)
{
    Session::State& session = f.session.state();
    if (f.kept_guide.knows()) guide = std::move(f.kept_guide);
    session.guide = std::move(guide);
    bring_back(f);
    f.records.insert(f.records.end(), std::make_move_iterator(f.without_radiance.begin()),
                     std::make_move_iterator(f.without_radiance.end()));
    session.put_back(std::move(f.records), f.asked, f.views.front());
}

void look_through(Frame& f, std::optional<KeptGuide>& guide, double gather_seconds)
{
    f.is_glance = true;
    begin_pass(f);
    draw_gbuffer(f);
    const bool may_gather = use_known_bounces(f);
    if (const auto known = f.session.state().find_error_scale(0.0)) f.error_scale = *known;
    do {
        light_directly(f);
        trace_lobes(f);
        if (f.is_first_view()) {
            if (guide) f.kept_guide = std::move(*guide);
            f.course.records = first_records(f);
        }
        light_by_records(f, may_gather && f.is_first_view() ? gather_seconds : 0.0);
        add_to_picture(f);
    } while (look_behind(f));
    finish_picture(f);
}

}  // namespace

RenderResult glance(Session& session, const Camera& camera, const RenderOptions& asked, const Haste& haste,
                    const ProgressFunction& progress)
{
    const RenderOptions options = hasty(asked, haste);
    const RenderHooks hooks{.progress = progress};
    Frame frame = begin_frame(session, camera, options, hooks);
    std::optional<KeptGuide> guide = std::exchange(session.state().guide, std::nullopt);
    if (guide && !guide->is_of(session.state().scene_number)) guide.reset();
    try {
        look_through(frame, guide, haste.gather_seconds);
    } catch (...) {
        put_back(frame, std::move(guide));
        throw;
    }
    put_back(frame, std::move(guide));
    frame.stats().kept = session.state().end_view();
    return std::move(frame.result);
}

}  // namespace rcs
