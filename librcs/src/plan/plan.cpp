#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "facts/scene_facts.h"
#include "gbuffer/views.h"
#include "material/bsdf.h"
#include "plan/plan_layers.h"
#include "plan/view_survey.h"
#include "radiance/harmonics.h"
#include "rays/ray_scene_impl.h"
#include "rcs/effect_plan.h"
#include "rcs/error.h"
#include "rcs/render_options.h"
#include "util/text.h"

namespace rcs {
namespace {

// Without a target of its own, a picture's further bounces may fall short by this part of the first one's power.
constexpr double kBounceShare = 1e-3;
// Of a target for the error, the part that left out bounces may take.
constexpr double kBounceShareOfTarget = 0.1;

std::string plural(std::size_t n, const char* one, const char* many) { return text("%zu %s", n, n == 1 ? one : many); }

/// Of the whole picture, so that a crop of it has the same plan.
std::vector<View> views_of(const Camera& camera, const RenderOptions& options)
{
    std::vector<View> views = make_views(camera, options.width, options.height, options.aa);
    open_lens(options, views);
    return views;
}

class Planner {
public:
    Planner(const RayScene& rays, const Camera& camera, const RenderOptions& options)
        : options_(options),
          built_(rays.impl().choice),
          facts_(scene_facts(rays)),
          view_(survey(rays, views_of(camera, options))),
          has_sky_image_(rays.impl().environment.has_image()),
          pixels_(static_cast<double>(options.width) * options.height)
    {
        plan_.effects.resize(kEffects);
        plan_.pilot_rays = view_.rays;
        for (std::size_t i = 0; i < kEffects; ++i) plan_.effects[i].effect = static_cast<Effect>(i);
    }

    EffectPlan plan()
    {
        reflects_ = view_[kReflects].possible();
        plan_light();
        plan_indirect();
        plan_passages();
        plan_textures();
        plan_instancing();
        plan_picture();
        plan_.layers = plan_layers(options_.layers, plan_.set(), pixels_);
        return std::move(plan_);
    }

private:
    PlannedEffect& decide(Effect effect, bool called_for, bool has_material, std::string reason)
    {
        return decide(effect, called_for, has_material, std::move(reason), options_.effects);
    }
    PlannedEffect& decide(Effect effect, bool called_for, bool has_material, std::string reason,
                          const EffectChoice& choice);
    void measured(PlannedEffect& e, const Sighting& s) const;
    /// Light may reach all that reflects, and nothing else.
    void bounded(PlannedEffect& e) const;
    std::string dark() const { return words(view_[kReflects], "surface that reflects"); }
    bool on(Effect effect) const { return plan_.needs(effect); }
    void plan_light();
    void plan_indirect();
    void plan_bounces(bool called_for);
    void plan_passages();
    void plan_textures();
    void plan_instancing();
    void plan_picture();

    const RenderOptions& options_;
    const EffectChoice& built_;  // what the rays' scene was built for
    SceneFacts facts_;
    Survey view_;
    bool has_sky_image_;
    double pixels_;
    bool reflects_ = false;
    EffectPlan plan_;
};

PlannedEffect& Planner::decide(Effect effect, bool called_for, bool has_material, std::string reason,
                               const EffectChoice& choice)
{
    PlannedEffect& e = plan_.effects[static_cast<std::size_t>(effect)];
    e.has_material = has_material;
    e.needed = called_for;
    e.reason = std::move(reason);
    if (choice.without.has(effect) ? called_for : choice.with.has(effect) && !called_for) {
        e.needed = !called_for;
        e.chosen = true;
        e.reason = (called_for ? "left out on demand, though " : "simulated on demand, though ") + e.reason;
        e.loss = called_for ? 1.0 : 0.0;
        e.basis = called_for ? PlannedEffect::Basis::bound : PlannedEffect::Basis::exact;
    }
    return e;
}

void Planner::bounded(PlannedEffect& e) const
{
    e.of = "pixels";
    e.basis = PlannedEffect::Basis::bound;
    e.share = e.high = e.needed ? view_[kReflects].high : 0.0;
}

void Planner::measured(PlannedEffect& e, const Sighting& s) const
{
    e.of = "pixels";
    if (s.how != Sighting::How::seen && s.how != Sighting::How::unsettled) return;
    e.basis = PlannedEffect::Basis::measured;
    e.share = s.share;
    e.low = s.low;
    e.high = s.high;
}

void Planner::plan_light()
{
    const double samples = pixels_ * options_.aa;
    const Sighting& glow = view_[kEmits];
    PlannedEffect& emission =
        decide(Effect::emission, glow.possible() || facts_.sky, facts_.with(kEmits) > 0 || facts_.sky,
               facts_.sky && !glow.possible() ? "the background is a sky that is not black"
                                              : words(glow, "surface that shines"));
    measured(emission, glow);
    emission.cost = "3 floats a pixel";
    emission.bytes = 12.0 * pixels_;

    PlannedEffect& punctual =
        decide(Effect::punctual_light, reflects_ && facts_.punctual > 0, facts_.punctual > 0,
               facts_.punctual == 0 ? "no lamp without size shines"
               : reflects_          ? plural(facts_.punctual, "lamp without size shines", "lamps without size shine")
                                    : dark());
    bounded(punctual);
    punctual.cost = "a shadow ray a sample and lamp, and one for each gather hit";
    punctual.rays = samples * view_[kReflects].share * static_cast<double>(facts_.punctual);

    PlannedEffect& area = decide(Effect::area_light, reflects_ && facts_.triangles > 0, facts_.triangles > 0,
                                 facts_.triangles == 0 ? "no triangle shines"
                                 : reflects_           ? plural(facts_.triangles, "triangle shines", "triangles shine")
                                                       : dark());
    bounded(area);
    area.cost = "a shadow ray a sample and lamp or more, most in penumbras, and one for each gather hit";
    area.rays = pixels_ * view_[kReflects].share * options_.area_samples;

    const std::string no_sky = "the sky's radiance is 0";
    PlannedEffect& sky =
        decide(Effect::environment, reflects_ && facts_.sky, facts_.sky,
               !facts_.sky  ? no_sky
               : !reflects_ ? dark()
                            : text("the sky is not black; %.3g %% of the picture shows it", 100.0 * view_.sky_share));
    bounded(sky);
    sky.cost = "a shadow ray for each gather hit";
    PlannedEffect& peaks = decide(Effect::environment_peaks, reflects_ && facts_.peaks, facts_.peaks,
                                  !facts_.sky     ? no_sky
                                  : !facts_.peaks ? "no part of the sky is brighter than 8 times its mean"
                                  : !reflects_    ? dark()
                                                  : "parts of the sky are brighter than 8 times its mean");
    bounded(peaks);
    peaks.cost = "shadow rays as for area light";
    peaks.rays = pixels_ * view_[kReflects].share * options_.area_samples;

    const Sighting& lobe = view_[kHasLobe];
    PlannedEffect& highlights =
        decide(Effect::highlights, lobe.possible() && facts_.lamps, facts_.with(kHasLobe) > 0,
               lobe.possible() && !facts_.lamps ? "no lamp shines" : words(lobe, "surface with a specular lobe"));
    measured(highlights, lobe);
    highlights.cost = "the BSDF of each pixel, and rays along lobes narrower than lamps";
    highlights.bytes = pixels_ * (static_cast<double>(sizeof(Lobe)) * facts_.most_lobes + 16.0);
}

void Planner::plan_bounces(bool called_for)
{
    const double albedo = facts_.most_albedo;
    const double share = target_error(options_) > 0.0 ? kBounceShareOfTarget * target_error(options_) : kBounceShare;
    // Each bounce has at most `albedo` of the power of the one before: after n of them albedo^n / (1 - albedo) is
    // missing.
    const auto missing = [&](int n) {
        return albedo < 1.0 ? std::pow(albedo, n) / (1.0 - albedo) : std::numeric_limits<double>::infinity();
    };
    int enough = 1;
    while (enough < options_.bounces && missing(enough) > share) ++enough;
    const int wanted = called_for ? std::min(options_.bounces, enough) : 0;
    std::string reason;
    if (!called_for)
        reason = "there is no first bounce";
    else if (options_.bounces <= 1)
        reason = text("%d asked for", options_.bounces);
    else if (wanted < options_.bounces)
        reason = text(
            "surfaces reflect at most %.3g of the light: beyond %d of the %d bounces asked for less than %.2g of the "
            "first one's power comes",
            albedo, wanted, options_.bounces, share);
    else
        reason = text("%d bounces asked for; surfaces reflect up to %.3g of the light", options_.bounces, albedo);
    PlannedEffect& e = options_.bounces > 1 ? decide(Effect::more_bounces, wanted > 1, true, std::move(reason))
                                            : decide(Effect::more_bounces, false, false, std::move(reason), {});
    plan_.bounces = options_.bounces > 1 && options_.effects.with.has(Effect::more_bounces) ? options_.bounces
                    : e.needed                                                              ? wanted
                                                                                            : std::min(wanted, 1);
    e.of = "the first bounce's power";
    e.basis = PlannedEffect::Basis::bound;
    e.share = e.high = e.needed ? std::min(1e3, missing(1)) : 0.0;
    if (called_for && plan_.bounces > 0 && plan_.bounces < options_.bounces && !e.chosen)
        e.loss = missing(plan_.bounces);
    e.cost = "a light cache: 64 rays for each of some ten thousand cells, and their shadows";
    e.bytes = 4e7;
}

void Planner::plan_indirect()
{
    const bool reflected = options_.bounces > 0 && (facts_.lamps || facts_.sky) && facts_.most_albedo > 0.0;
    const bool any = reflects_ && (reflected || facts_.sky);
    PlannedEffect& indirect = decide(Effect::indirect_diffuse, any, facts_.with(kReflects) > 0,
                                     !reflects_                      ? dark()
                                     : !(facts_.lamps || facts_.sky) ? "nothing shines"
                                     : !any ? "no bounce is asked for and the sky's radiance is 0"
                                            : dark());
    measured(indirect, view_[kReflects]);
    indirect.cost = text("records of about 250 bytes with %d rays and more, splatted in each pass",
                         settings_or_default(options_).rays);
    indirect.bytes = 100.0 * pixels_;

    const std::string roughness =
        facts_.least_roughness > facts_.most_roughness
            ? ""
            : text("; lobes of the scene have roughness %.2g to %.2g", static_cast<double>(facts_.least_roughness),
                   static_cast<double>(facts_.most_roughness));
    const auto lobes = [&](Effect effect, Trait trait, const char* what) -> PlannedEffect& {
        const Sighting& s = view_[trait];
        PlannedEffect& e = decide(effect, s.possible() && any, facts_.with(trait) > 0,
                                  s.possible() && !any ? "there is no indirect light" : words(s, what) + roughness);
        measured(e, s);
        return e;
    };
    PlannedEffect& wide = lobes(Effect::glossy_records, kWideLobe, "surface with a lobe of roughness 0.55 or more");
    if (wide.needed && !indirect.needed) {
        wide.needed = false;
        wide.reason = "left out with indirect-diffuse, though " + wide.reason;
    }
    wide.cost =
        text("%d floats more a record, a wider splat target and %d floats a pixel", 3 * kHarmonics, kHarmonics + 4);
    wide.bytes = pixels_ * 4.0 * (kHarmonics + 4);
    PlannedEffect& narrow = lobes(Effect::traced_lobes, kNarrowLobe, "coat, or a lobe of roughness below 0.55");
    narrow.cost =
        text("%d rays for each pixel of such a surface, and the shadow rays of what they hit", options_.lobe_rays);
    narrow.rays = pixels_ * view_[kNarrowLobe].share * options_.lobe_rays;
    narrow.bytes = 16.0 * pixels_;

    const bool forced = indirect.chosen && indirect.needed && options_.bounces > 0;
    plan_bounces((indirect.needed || narrow.needed) && (reflected || forced));
}

/// What lets light through, for rays and for the camera.
void Planner::plan_passages()
{
    const auto in_rays = [&](Effect effect, Trait trait, const char* is, const char* what) {
        const std::size_t meshes = facts_.with(trait);
        const bool declared = (facts_.declared & trait) != 0u;
        PlannedEffect& e = decide(effect, meshes > 0, declared,
                                  meshes > 0 ? text("%s %s", plural(meshes, "mesh", "meshes").c_str(), what)
                                  : declared ? text("materials are %s, but no texel or vertex %s", is, what)
                                             : text("no material is %s", is),
                                  built_);
        e.needed = e.needed && (facts_.simulated & trait) != 0u;  // what no surface has, nothing can ask for
        e.of = "meshes";
        e.share = static_cast<double>(meshes) / std::max<double>(1.0, static_cast<double>(facts_.used_meshes));
        e.cost = "rays ask each such surface that they meet";
    };
    in_rays(Effect::transmission, kTransmits, "transmitting", "lets light through");
    in_rays(Effect::alpha_mask, kMasked, "masked", "has alpha below the cutoff");
    in_rays(Effect::alpha_blend, kBlended, "blended", "has alpha below 1");

    const std::uint32_t asked = facts_.simulated & kSeeThrough;
    const Sighting* through = &view_[kMasked];
    for (const Trait trait : {kBlended, kTransmits})
        if (view_[trait].how > through->how ||
            (view_[trait].how == through->how && view_[trait].share > through->share))
            through = &view_[trait];
    PlannedEffect& peeling =
        decide(Effect::peeling, asked != 0u && through->possible(), (facts_.declared & kSeeThrough) != 0u,
               asked == 0u ? "no surface lets light through" : words(*through, "surface that lets light through"));
    measured(peeling, *through);
    peeling.cost = "16 bytes a pixel, and for each further layer a G-buffer, its light and a splat";
    peeling.bytes = 28.0 * pixels_;
}

void Planner::plan_textures()
{
    const bool hits = (on(Effect::indirect_diffuse) && plan_.bounces > 0) || on(Effect::traced_lobes);
    const Sighting& bumps = view_[kBumpy];
    const bool maps = bumps.possible() || (hits && facts_.with(kBumpy) > 0);
    PlannedEffect& normals =
        decide(Effect::normal_maps, maps, (facts_.declared & kBumpy) != 0u,
               facts_.with(kBumpy) == 0 && (facts_.declared & kBumpy) != 0u ? "no normal texture turns a normal"
               : maps && !bumps.possible() ? words(bumps, "surface with a normal map") + ", but rays meet them"
                                           : words(bumps, "surface with a normal map"),
               built_);
    normals.needed = normals.needed && (facts_.simulated & kBumpy) != 0u;
    measured(normals, bumps);
    normals.cost = "a texture fetch for each pixel and each hit on such a surface";

    const std::size_t textured = facts_.with(kTextured);
    PlannedEffect& textures =
        decide(Effect::hit_textures, hits && textured > 0, (facts_.declared & kTextured) != 0u,
               !hits          ? "no ray's hit is lit"
               : textured > 0 ? text("%s reflect%s by textures that vary", plural(textured, "mesh", "meshes").c_str(),
                                     textured == 1 ? "s" : "")
                              : "no mesh reflects by a texture that varies");
    textures.of = "meshes";
    textures.share = static_cast<double>(textured) / std::max<double>(1.0, static_cast<double>(facts_.used_meshes));
    textures.cost = "a fetch for each hit that counts; else the texture's mean";
}

void Planner::plan_instancing()
{
    PlannedEffect& instancing =
        decide(Effect::instancing, facts_.instanced > 0, facts_.shared_meshes > 0,
               facts_.shared_meshes == 0
                   ? "no mesh is used twice"
                   : text("%s used more than once", plural(facts_.shared_meshes, "mesh is", "meshes are").c_str()),
               built_);
    instancing.needed = facts_.instanced > 0;  // as the rays' scene was built
    instancing.cost = "a transformation for each ray that enters an instance";
}

void Planner::plan_picture()
{
    const bool varied = view_.any_in_view || has_sky_image_;
    PlannedEffect& aa = decide(Effect::anti_aliasing, options_.aa > 1 && varied, options_.aa > 1,
                               options_.aa <= 1 ? "one sample a pixel asked for"
                               : varied         ? text("%d samples a pixel asked for", options_.aa)
                                                : "nothing lies in the view, and the sky is the same everywhere",
                               options_.aa > 1 ? options_.effects : EffectChoice{});
    plan_.passes = aa.needed ? options_.aa : 1;
    aa.cost = "all that is done for each pass";
    const bool goal = has_goal(options_);
    // Rays along lobes may meet what is smaller than a pixel; goals weigh passes before it is known how much they
    // share.
    plan_.shares_samples = plan_.passes > 1 && !options_.effects.with.has(Effect::anti_aliasing) && !goal &&
                           !options_.f_stop && !on(Effect::peeling) && !on(Effect::traced_lobes);
    if (plan_.shares_samples) {
        aa.reason += text(
            "; where light strays from even growth by less than %.2g %%, samples on the first one's triangle share its "
            "light",
            100.0 * kSmooth);
        aa.of = "a pixel's light";
        aa.basis = PlannedEffect::Basis::bound;
        aa.share = aa.high = 1.0;
        aa.loss = kSmooth;
    }

    const bool indirect = on(Effect::indirect_diffuse) || on(Effect::traced_lobes);
    PlannedEffect& error = decide(Effect::error_estimate, indirect, indirect,
                                  !indirect ? "there is no indirect light"
                                  : goal    ? "a target or budget steers by it"
                                            : "every picture states the error of its indirect light");
    if (goal && indirect) {
        error.needed = true;
        error.reason = "a target or budget steers by it";
        error.chosen = false;
    }
    error.cost = "three sums more in each splat, and a pass over the picture";
    error.bytes = 20.0 * pixels_;
}

}  // namespace

EffectPlan plan_effects(const RayScene& rays, const Camera& camera, const RenderOptions& options)
{
    validate(options);
    if (options.f_stop && camera.projection != Projection::perspective)
        throw Error(ErrorCode::bad_argument,
                    "f_stop is given for camera '" + camera.name + "', which is orthographic: it has no focal length");
    return Planner(rays, camera, options).plan();
}

}  // namespace rcs
