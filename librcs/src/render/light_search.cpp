#include "render/light_search.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "compose/compose.h"
#include "compose/contacts.h"
#include "compose/lamp_checks.h"
#include "glossy/further_lobes.h"
#include "glossy/lobe_trial.h"
#include "records/guided_gathers.h"
#include "records/lamps_to_gather.h"
#include "render/upkeep.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Of a pixel at a contact, first of all, and at the most where noise would show; so many times that for less noise.
constexpr int kContactRays = 16, kMostContactRays = 192;
constexpr float kFiner = 8.0f;
// It may be so much noisier than wide plain surfaces.
constexpr float kContactNoise = 3.5f;

// Narrow lobes may be so much noisier, of pixels that have light but for this part of the picture's mean; and have so
// many more rounds of rays at the most.
constexpr float kLobeNoise = 3.0f, kDarkLight = 0.01f;
constexpr int kMostFurther = 5;

/// Of the pass: as little noise as the records are to have.
ContactSettings contact_settings(const Frame& f)
{
    const float noise = f.course.records.noise_target, usual = RecordSettings{}.noise_target;
    const float finer = std::clamp(usual * usual / (noise * noise), 1.0f, kFiner);
    ContactSettings settings;
    settings.noise = kContactNoise * noise;
    settings.most_rays = static_cast<int>(finer * static_cast<float>(kMostContactRays));
    settings.now = f.session.state().view_number + 1;
    return settings;
}

KeptGuide find_light(const Frame& f, int views)
{
    const Session::State& session = f.session.state();
    LightSearch found = search_light({f.rays, f.light_cache, nullptr, &f.gathered}, f.gbuffer, f.view(),
                                     f.course.records, !session.watches() && !f.moments, f.session.pool());
    return {.guide = std::move(found.guide),
            .direct = std::move(found.direct),
            .arrivals = std::move(found.arrivals),
            .views = views,
            .scene_number = session.scene_number};
}

}  // namespace

void part_lamps(Frame& f)
{
    if (!f.needs(Effect::indirect_diffuse)) return;
    f.gathered = lamps_to_gather({f.rays}, f.gbuffer, f.settings.records, f.session.pool());
    const auto differs = [&](const Record& r) { return r.gathered_lamps != f.gathered.id; };
    if (std::any_of(f.records.begin(), f.records.end(), differs) ||
        std::any_of(f.without_radiance.begin(), f.without_radiance.end(), differs)) {
        f.gathered = {};
        const std::size_t left_out = std::erase_if(f.records, differs) + std::erase_if(f.without_radiance, differs);
        if (left_out > 0 && f.hooks.log)
            f.hooks.log(LogLevel::warning, std::to_string(left_out) +
                                               " records of other views are not used: they hold "
                                               "light of huge lamps that shadow rays find in this view");
    }
    if (!f.gathered.any()) return;
    f.stats().records.gathered_lamps =
        static_cast<std::uint64_t>(std::count(f.gathered.of_instance.begin(), f.gathered.of_instance.end(), 1));
    if (f.is_glance) return;
    f.lamp_guide = std::make_unique<LampGuide>(f.rays, f.settings.effects, f.gathered, f.gbuffer, f.view(),
                                               f.settings.seed, f.session.pool());
    f.gathered.finder = f.lamp_guide.get();
}

HitRadiance light_of_hits(const Frame& f) { return {f.rays, f.light_cache, f.settings.effects, &f.gathered}; }

void ask_lamps(Frame& f)
{
    if (f.light.of_lamps.width == 0 || !f.gathered.finder) return;
    timed(f, "direct", [&] {
        const LampChecks checks = check_lamps(f.rays, light_of_hits(f), f.gbuffer, f.view(), f.direct.seed,
                                              f.session.pool(), f.light.of_lamps, f.light.indirect);
        f.stats().direct_shadow_rays += checks.shadow_rays;
        f.stats().lamp_checks += checks.pixels;
    });
}

LitScene light_at_contacts(Frame& f)
{
    LitScene lit = f.lit();
    lit.guide = f.first_guide ? &*f.first_guide : nullptr;
    lit.arrivals = f.first_arrivals ? &*f.first_arrivals : nullptr;
    return lit;
}

RecordSettings contact_gathers(const Frame& f)
{
    RecordSettings settings = f.course.records;
    settings.radiance = false;
    settings.rays = kContactRays;
    settings.seed = stream_key(f.settings.seed, Stream::contacts, 0);
    return settings;
}

namespace {

/// Tells of a stage's progress. @throws Error cancelled
auto reporter(const Frame& f, const char* stage)
{
    return [&f, stage](float fraction) {
        if (f.hooks.progress && !f.hooks.progress(stage, fraction))
            throw Error(ErrorCode::cancelled, std::string("cancelled in stage ") + stage);
    };
}

constexpr const char* kContactStage = "contacts";

}  // namespace

void gather_contacts(Frame& f)
{
    timed(f, kContactStage, [&] {
        // Passes that share samples see a part of them.
        std::optional<FirstContacts> first;
        if (f.shared && f.layer == 0) first.emplace(FirstContacts{f.shared->contacts, f.shared->known.met});
        f.contacts = pixels_at_contacts(f.gbuffer, f.session.pool(), first ? &*first : nullptr);
        renew_contacts(f);
        Session::State& session = f.session.state();
        f.stats().contact_rays += gather_contacts(RecordGatherer(light_at_contacts(f), contact_gathers(f)),
                                                  {f.gbuffer, f.view(), f.contacts, session.scene_number},
                                                  f.session.pool(), session.contacts, reporter(f, kContactStage));
    });
}

void ask_contacts(Frame& f)
{
    Session::State& session = f.session.state();
    timed(f, kContactStage, [&] {
        std::optional<RecordGatherer> gatherer;
        if (!f.is_glance)
            gatherer.emplace(light_at_contacts(f), contact_gathers(f));
        else
            f.contacts = pixels_at_contacts(f.gbuffer, f.session.pool());
        const ContactStats asked =
            ask_contacts(gatherer ? &*gatherer : nullptr, {f.gbuffer, f.view(), f.contacts, session.scene_number},
                         contact_settings(f), f.session.pool(), session.contacts, f.light.of_lamps, f.light.indirect,
                         reporter(f, kContactStage));
        f.stats().contacts += asked.pixels;
        f.stats().contact_rays += asked.rays;
    });
}

LobeSettings lobe_settings(const Frame& f, int round)
{
    LobeSettings settings = f.settings.lobes;
    settings.seed = stream_key(f.direct.seed, Stream::glossy, static_cast<std::uint64_t>(round));
    settings.gathered = &f.gathered;
    settings.guide = f.guide();
    settings.looks_per_pixel = f.guide() ? f.kept_guide.looks_of_lobes.count : 0;
    settings.direct = f.kept_guide.direct.get();
    return settings;
}

std::vector<std::uint8_t> noisy_lobes(const Frame& f)
{
    std::vector<float> light(f.gbuffer.size(), 0.0f);
    f.session.pool().parallel_for(light.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            light[i] = recorded_luminance(f.gbuffer, f.view(), f.shading, f.light.indirect, i);
    });
    double all = 0.0;
    for (std::size_t i = 0; i < light.size(); ++i)
        all += static_cast<double>(light[i] + luminance(f.light.traced.radiance[i]));
    const float dark = kDarkLight * static_cast<float>(all / static_cast<double>(light.size()));
    for (float& one : light) one += dark;
    // Every pass samples by itself.
    const float of_pass = std::sqrt(static_cast<float>(f.course.passes));
    return further_rounds(f.gbuffer, f.shading, f.light.traced, light,
                          {kLobeNoise * f.course.records.noise_target * of_pass, kMostFurther});
}

void choose_looks(Frame& f)
{
    if (!f.guide() || f.settings.lobes.bounces == 0) return;
    WorthwhileLooks& looks = f.kept_guide.looks_of_lobes;
    if (looks.is_sure && looks.count == 0) return;
    timed(f, "glossy", [&] {
        // Also what of it this view sees first: who is taken to see little, and sees it, is far too bright.
        learn_along_lobes(f.rays, light_of_hits(f), f.gbuffer, f.view(), f.shading,
                          stream_key(f.settings.seed, Stream::views, static_cast<std::uint64_t>(f.kept_guide.views)),
                          f.session.pool(), *f.kept_guide.guide);
        if (!looks.is_sure)
            looks = worthwhile_looks(f.rays, light_of_hits(f), f.gbuffer, f.view(), f.shading, lobe_settings(f, 0),
                                     f.session.pool());
    });
}

/// In the scene of another moment, looks do no good where they did none; what was lit is lit otherwise where things
/// that moved may stand before a lamp. Where that is much, another search pays.
void follow_moves(Frame& f)
{
    KeptGuide& kept = f.kept_guide;
    const Session::State& session = f.session.state();
    if ((kept.is_of(session.scene_number) || kept.follow(session.scene_number, session.changes)) &&
        kept.leave_out(f.rays, f.session.pool()))
        return;
    kept = find_light(f, kept.views);
}

void look_around(Frame& f)
{
    if (!f.needs(Effect::indirect_diffuse) && !f.needs(Effect::traced_lobes)) return;
    timed(f, "records", [&] {
        if (f.is_first_view()) {
            if (auto kept = f.session.state().take_guide())
                f.kept_guide = std::move(*kept);
            else
                f.kept_guide = find_light(f, 0);
        }
        if (f.is_first_view() || f.has_moved) {
            follow_moves(f);
            f.first_guide.reset(), f.first_arrivals.reset();
            if (f.guide()) f.first_guide = *f.guide();
            if (f.kept_guide.arrivals) f.first_arrivals = *f.kept_guide.arrivals;
        }
        if (f.guide()) f.stats().records.lit_points = f.guide()->lit().points.size();
        if (f.kept_guide.direct) f.stats().records.direct_cells = f.kept_guide.direct->lights.size();
    });
}

}  // namespace rcs
