#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "accuracy/error_estimate.h"
#include "accuracy/probes.h"
#include "compose/sampled_light.h"
#include "direct/drawn_light.h"
#include "glossy/further_lobes.h"
#include "glossy/lobes_together.h"
#include "placement/view_fit.h"
#include "rcs/error.h"
#include "rcs/option_table.h"
#include "render/frame.h"
#include "render/light_search.h"
#include "render/moments.h"
#include "render/past_light.h"
#include "render/upkeep.h"
#include "util/random.h"

namespace rcs {
namespace {

// Images through points of a lens that are so far apart seem to be one blur [px]...
constexpr double kApart = 3.0;
// ... where so much of the picture is no more blurred than that.
constexpr double kSharper = 0.99;

/// What is at hand for the first view: records of other views.
void prepare_records(Frame& f)
{
    f.course.records = first_records(f);
    if (f.session.state().options.keep_records) f.aside = take_unseen(f.view(), f.records);
    fit_to_view(f.gbuffer, f.view(), f.session.state().record_pixel == image_plane(f.view()).pixel, f.records);
    bring_up_to_date(f);
}

/// What holds in the scene of another moment than the pass before's.
void follow_scene(Frame& f)
{
    bring_up_to_date(f);
    f.corrected = 0;
    f.has_moved = false;
}

/// Records of earlier passes are shared; this one adds where it sees what they did not.
void add_records(Frame& f)
{
    RecordSettings settings = f.course.records;
    if (!has_goal(f.asked)) settings.noise_target *= f.session.state().noise.slack.value_or(1.0f);
    place_records(f.lit(), f.gbuffer, f.view(), settings, f.session.pool(), f.records, f.stats().records,
                  f.hooks.progress);
}

/// What independent gathers at some of the first view's pixels say of its error; those of an earlier view, where its
/// records are still there.
ErrorScale probe(Frame& f)
{
    Session::State& session = f.session.state();
    // Also what the view before did not see.
    const auto others = std::count_if(f.records.begin(), f.records.end(),
                                      [&](const Record& r) { return r.watch.view != session.view_number; });
    const auto changed = (static_cast<double>(others) + static_cast<double>(f.stats().records.renewed)) /
                         static_cast<double>(std::max<std::size_t>(1, f.records.size()));
    if (const auto known = session.find_error_scale(changed); known && !f.probes) return *known;
    return timed(f, "probes", [&] {
        if (!f.probes)
            f.probes = std::make_unique<Probes>(f.lit().by_samples(), f.gbuffer, f.course.records, f.session.pool());
        const ErrorMap& map = f.light.indirect_error;
        // Also those of earlier views: the same records say the same of their error.
        const double rays = std::accumulate(f.records.begin(), f.records.end(), 0.0, [](double sum, const Record& r) {
            return sum + static_cast<double>(r.rays);
        });
        f.probes->spend(Probes::worth(rays), f.light.indirect, map);
        f.stats().probe_rays = f.probes->rays();
        const ErrorScale found = f.probes->compare(f.light.indirect, map);
        f.probes.reset();
        session.keep_error_scale(found);
        return found;
    });
}

/// @param only  pixels that have it; null: all
TracedLight trace_round(Frame& f, int round, const std::vector<std::uint8_t>* only = nullptr)
{
    ++f.stats().counts.lobe_passes;
    return timed(f, "glossy", [&] {
        LobeSettings settings = lobe_settings(f, round);
        std::optional<PastTraced> past;
        if (f.past && round == 0 && !f.past->kept.traced.radiance.empty()) {
            if (!f.past->places) return f.past->kept.traced;
            past.emplace(f.past->traced());
        }
        settings.past = past ? &*past : nullptr;
        settings.only = only;
        if (only) settings.checked.reset();  // the first round's were by as many rays as tell of it
        return trace_lobes(f.rays, light_of_hits(f), f.gbuffer, f.view(), f.shading, settings, f.session.pool(),
                           f.stats().traced);
    });
}

/// Pixels whose lobes look about the same way put together what they found, but for filters.
void put_lobes_together(Frame& f)
{
    if (!f.direct.together) return;
    timed(f, "glossy", [&] { put_together(f.gbuffer, f.shading, f.session.pool(), f.light.traced); });
}

/// Rays along narrow lobes go on where they would show noise.
void trace_noisy(Frame& f)
{
    const bool is_the_same = f.past && !f.past->places;
    if (f.light.traced.radiance.empty() || has_goal(f.asked) || is_the_same) return;
    std::vector<std::uint8_t> left = timed(f, "glossy", [&] { return noisy_lobes(f); });
    const int rounds = left.empty() ? 0 : *std::max_element(left.begin(), left.end());
    for (int round = 1; round <= rounds; ++round) {
        add_round(f.light.traced, trace_round(f, round, &left), &left);
        for (std::uint8_t& of_pixel : left) of_pixel -= of_pixel > 0 ? 1 : 0;
    }
    if (rounds > 0) put_lobes_together(f);
}

DirectLightResult direct_round(Frame& f, int round)
{
    return timed(f, "direct", [&] {
        std::optional<PastDirect> past;
        if (f.past && round == 0 && !f.past->kept.direct.irradiance.empty()) {
            if (!f.past->places) return f.past->kept.direct;
            past.emplace(f.past->direct());
        }
        DirectSettings settings = f.direct;
        if (round > 0) settings.seed = stream_key(settings.seed, Stream::direct, static_cast<std::uint64_t>(round));
        return direct_light(f.rays, f.gbuffer, f.view(), f.shading, settings, f.session.pool(),
                            f.stats().direct_shadow_rays, past ? &*past : nullptr);
    });
}

/// Says so where passes are too few to show blur as such.
void warn_of_ghosts(const Frame& f)
{
    if (!f.asked.f_stop || !f.hooks.log) return;
    const View& view = f.view();
    const Lens lens = lens_of(f.camera, *f.asked.f_stop, *f.asked.focus);
    const glm::vec3 forward(-glm::dvec3(view.camera.world_from_view[2]));
    const double pixel = image_plane(view).pixel;
    std::vector<double> widths;
    for (std::size_t i = 0; i < f.gbuffer.size(); ++i) {
        if (!f.gbuffer.covered(i)) continue;
        const auto depth = static_cast<double>(glm::dot(f.gbuffer.position(i), forward));
        widths.push_back(circle_of_confusion(lens, depth) / pixel);
    }
    if (widths.empty()) return;
    const auto wide = widths.begin() + static_cast<std::ptrdiff_t>(kSharper * static_cast<double>(widths.size()));
    std::nth_element(widths.begin(), wide, widths.end());
    const double filled = kApart * std::sqrt(4.0 * std::numbers::inv_pi * f.asked.aa);
    if (*wide <= filled) return;
    const double enough = std::ceil(0.25 * std::numbers::pi * *wide * *wide / (kApart * kApart));
    const double most = find_option("aa").range.most;
    f.hooks.log(LogLevel::warning, "points out of focus are up to " + number_text(std::round(*wide)) +
                                       " px wide, of which --aa " + number_text(f.asked.aa) +
                                       " shows single images: --aa " + number_text(std::min(enough, most)) +
                                       (enough > most ? ", the most there is, shows fewer" : " would fill them"));
}

/// @param splats  what those of the records took
void judge_records(Frame& f, const SplatStats& splats)
{
    f.light.indirect_error = timed(
        f, "estimate", [&] { return error_map(f.light.indirect, splats, f.settings.splat.overlap, f.session.pool()); });
    ++f.stats().counts.error_passes;
    if (f.is_first_view()) f.error_scale = probe(f);
    scale(f.light.indirect_error, f.error_scale, f.session.pool());
}

/// Goes on to the moment of a further pass.
void show_moment(Frame& f)
{
    Moment moment = timed(f, "load", [&] { return (*f.moments)(part_of_shutter(f.asked, f.pass)); });
    const auto pass = static_cast<std::size_t>(f.pass);
    f.camera = moment.camera;
    f.views[pass] = views_of(f.camera, f.asked, f.settings.passes)[pass];
    if (!moment.scene) return;
    const std::uint32_t before = f.session.state().scene_number;
    timed(f, "bvh", [&] {
        f.session.show(std::move(*moment.scene));
        f.rays = f.session.rays(f.asked.effects);
        f.session.state().prepare_caster(f.session.gl(), f.asked.gather, f.hooks.log);
    });
    if (f.session.state().scene_number == before) return;
    f.has_moved = true;
    f.light_cache = nullptr;
    f.layers.emplace(picture_layers(f.stats().plan, f.rays.get().scene(), std::nullopt, f.oidn != nullptr));
}

}  // namespace

bool begin_pass(Frame& f)
{
    if (!wants_pass(f.course, f.deadline, f.pass + 1, f.settings.passes)) return false;
    if (f.moments && f.pass >= 0) watch_records(f);  // before what they see moves
    ++f.pass;
    if (f.moments && f.pass > 0) show_moment(f);
    f.direct = f.course.direct;
    f.direct.seed = pass_seed(f.settings.seed, f.pass);
    return true;
}

void draw_gbuffer(Frame& f)
{
    f.layer = 0;
    f.gbuffer = {}, f.shading = {}, f.weight = {}, f.light = {};  // memory first
    f.gbuffer = timed(f, "gbuffer", [&] {
        return render_gbuffer(f.session.gl(), f.rays, f.view(), f.settings.texture_scale, f.session.pool(),
                              f.settings.effects, f.shading, f.known());
    });
    if (f.pass == 0) warn_of_ghosts(f);
    ++f.stats().counts.gbuffers;
    note_bytes(f.shading, f.stats().counts);
}

void spread_bounces(Frame& f)
{
    if (!f.needs(Effect::more_bounces) || f.light_cache) return;
    const LightCacheUse use{f.view(), f.settings.light_cache};
    f.light_cache = f.session.state().find_light_cache(use);
    if (f.light_cache) return;
    f.light_cache = timed(f, "bounces", [&] {
        LightCache cache = build_light_cache(f.rays, f.gbuffer, f.view(), f.settings.light_cache, f.session.pool(),
                                             f.stats().light_cache, f.hooks.progress);
        return f.session.state().keep_light_cache(std::move(cache), use);
    });
}

void light_directly(Frame& f)
{
    f.light = {};
    f.light.layers = &*f.layers;
    if (f.settings.has_lamps) {
        if (f.is_first_view() || f.has_moved) timed(f, "lamps", [&] { part_lamps(f); });
        if (f.is_first_view()) f.direct = f.course.direct = affordable_direct(f);
        f.direct.error = f.direct.error || goes_on(f);  // which says what of the samples is noise
        f.direct.gathered = &f.gathered;
    }
    look_back(f);
    if (!f.settings.has_lamps) return;
    f.light.direct = direct_round(f, 0);
    ++f.stats().counts.direct_passes;
}

void trace_lobes(Frame& f)
{
    if (!f.needs(Effect::traced_lobes)) return;
    if (f.is_first_view() || f.has_moved) choose_looks(f);
    f.light.traced = trace_round(f, 0);
    put_lobes_together(f);
}

void place_records(Frame& f)
{
    if (!f.needs(Effect::indirect_diffuse)) return;
    timed(f, "records", [&] {
        if (f.is_first_view()) prepare_records(f);
        if (f.has_moved) follow_scene(f);
    });
    gather_contacts(f);
    timed(f, "records", [&] {
        if (f.is_first_view() && has_goal(f.asked)) return steer_records(f, true);
        add_records(f);
    });
}

void place_plain_records(Frame& f)
{
    if (!f.needs(Effect::indirect_diffuse)) return;
    timed(f, "records", [&] {
        prepare_records(f);
        if (has_goal(f.asked)) return steer_records_ahead(f);
        add_records(f);
    });
}

void forecast_records(Frame& f)
{
    timed(f, "records", [&] { prepare_records(f); });
    gather_contacts(f);
    timed(f, "records", [&] { steer_records(f, false); });
}

void splat_records(Frame& f)
{
    if (!f.needs(Effect::indirect_diffuse)) return;
    correct_records(f);
    RecordedLight light = splat_light(f, f.records);
    f.light.indirect = std::move(light.all);
    f.light.of_lamps = std::move(light.of_lamps);
    ask_contacts(f);
    if (f.settings.splat.error_sums) judge_records(f, light.stats);
    ask_lamps(f);
}

void sample_further(Frame& f)
{
    trace_noisy(f);
    keep_samples(f);
    Rounds done;
    for (Rounds next = next_round(f, done);; next = next_round(f, done)) {
        if (next.lobes > done.lobes) {
            add_round(f.light.traced, trace_round(f, done.lobes));
            put_lobes_together(f);
        } else if (next.direct > done.direct) {
            add_round(f.light.direct, direct_round(f, done.direct), done.direct);
            if (!f.light.direct.apart.irradiance.empty()) put_together(f.gbuffer, {}, f.session.pool(), f.light.direct);
        } else
            break;
        done = next;
    }
    if (f.is_first_view()) f.course.rounds = done;
}

void add_to_picture(Frame& f)
{
    timed(f, "compose", [&] {
        LayeredImage& sums = f.result.image;
        f.stats().unserved_pixels += accumulate_pass(f.gbuffer, f.view(), f.shading, shown(f.light), f.weight,
                                                     f.known(), sums, f.session.pool());
        if (f.shared)
            f.stats().counts.shared_samples += add_shared(*f.shared, sums);
        else if (f.is_first_view() && f.settings.shares_samples && !f.moments)
            f.shared = find_smooth(f.gbuffer, f.light.direct, f.contacts, sums, f.session.pool());
    });
}

void show_picture(Frame& f)
{
    const int done = f.pass + 1;
    if (!f.hooks.after_pass || done >= f.course.passes) return;
    f.hooks.after_pass(done, f.course.passes, [&] {
        LayeredImage so_far = f.result.image;
        finish_passes(done, so_far);
        so_far.layers.erase(kSampledLayer);
        cut_to_crop(f, so_far);
        return so_far;
    });
}

void tell_step(Frame& f, const RecordLook& look)
{
    if (!f.hooks.after_step || !f.shading.through.empty()) return;
    f.hooks.after_step([&] {
        RecordedLight all;
        if (f.settings.records.radiance || f.gathered.any())
            all = splat_light(f, f.records);  // steering sees a part of it
        const ShownLight light{*f.light.layers, f.light.direct, all.all.width != 0 ? all.all : look.sums,
                               all.of_lamps,    look.errors,    f.light.traced};
        PictureSoFar picture;
        accumulate_pass(f.gbuffer, f.view(), f.shading, light, f.weight, nullptr, picture.image, f.session.pool());
        finish_passes(1, picture.image);
        picture.image.layers.erase(kSampledLayer);
        cut_to_crop(f, picture.image);
        picture.errors = estimate_errors(picture.image, look.scale, f.session.pool());
        return picture;
    });
}

}  // namespace rcs
