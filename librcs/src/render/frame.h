#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "accuracy/error_scale.h"
#include "accuracy/probes.h"
#include "compose/compose.h"
#include "compose/contacts.h"
#include "compose/shared_samples.h"
#include "denoise/oidn.h"
#include "gbuffer/shading.h"
#include "lamps/gathered_lamps.h"
#include "lit_points/gather_guide.h"
#include "lit_points/lamp_guide.h"
#include "placement/error_driven.h"
#include "placement/view_fit.h"
#include "rcs/render.h"
#include "render/course.h"
#include "render/effect_counts.h"
#include "render/settings.h"
#include "render/stage_clock.h"
#include "session/session_state.h"

namespace rcs {

/// Samples of the view before, and where this pass's points lie among them.
struct PastSamples {
    const KeptSamples& kept;
    std::optional<PastPlaces> places;  ///< none: that view is this one, and nobody samples again
    std::uint64_t number;              ///< of all such passes of the session
    std::uint64_t turn;                ///< of this pass
    bool is_still;                     ///< the view is this one, things may have moved

    PastDirect direct() const
    {
        return {*places, kept.direct, kept.all, kept.little_direct, kept.moved, turn, number, is_still};
    }
    PastTraced traced() const { return {*places, kept.traced, kept.all}; }
};

/// A picture in the making.
struct Frame {
    Session& session;
    std::reference_wrapper<const RayScene> rays;
    Camera camera;  ///< of the moment
    const RenderOptions& asked;
    const RenderHooks& hooks;
    const Settings settings;
    SplatMethod splat_method;             ///< tiles, once another has failed
    const MomentFunction* moments;        ///< of the passes; null: all are of one
    std::optional<PictureLayers> layers;  ///< that are made
    const Deadline deadline;
    const EffectTally tally;
    Course course;               ///< that quality steers
    std::vector<View> views;     ///< one for each pass there may be
    std::unique_ptr<Oidn> oidn;  ///< if the picture is to be filtered
    RenderResult result;         ///< its image holds sums until the last pass is done

    // What passes share.
    std::vector<Record> records = {};
    std::vector<Record> without_radiance =
        {};                                ///< of records handed over: no use to glossy surfaces, but to other views
    std::vector<Record> aside = {};        ///< records that nothing in view is near, as they were
    std::vector<TakenOut> elsewhere = {};  ///< records near nothing that shows through, one layer after the other
    const LightCache* light_cache = nullptr;
    GatheredLamps gathered = {};
    std::unique_ptr<LampGuide> lamp_guide = {};  ///< of those, if there are any
    KeptGuide kept_guide = {};
    std::optional<GatherGuide> first_guide = {};    ///< of that, what it was before this view's records taught it
    std::optional<ArrivalMap> first_arrivals = {};  ///< the same
    std::optional<SharedSamples> shared = {};
    std::vector<PixelAtContact> contacts = {};  ///< of the view
    std::unique_ptr<Probes> probes = {};        ///< that a goal was steered by, until the first view is judged
    std::size_t corrected = 0;                  ///< records when their corrections were last set; 0: they are to be set
    ErrorScale error_scale = {};                ///< what probes found of the first view's error map

    bool is_glance = false;  ///< what only takes noise away is left out
    bool has_moved = false;  ///< another scene than the pass before's, which the light knows nothing of yet

    // The pass: surfaces in view, those seen through others one layer after the other, and their light.
    int pass = -1;
    int layer = 0;
    DirectSettings direct = {};
    GBuffer gbuffer = {};
    Shading shading = {};
    /// per pixel, how much light comes through the layers in front; empty: there are none
    std::vector<glm::vec3> weight = {};
    std::optional<PastSamples> past = {};
    PassLight light = {};

    const View& view() const { return views[static_cast<std::size_t>(pass)]; }
    bool is_first_view() const { return pass == 0 && layer == 0; }
    bool needs(Effect effect) const { return settings.needs(effect); }
    RenderStats& stats() { return result.stats; }
    const GatherGuide* guide() const { return kept_guide.guide.get(); }
    LitScene lit() const
    {
        return {rays,
                light_cache,
                kept_guide.guide.get(),
                &gathered,
                session.state().graphics.caster.get(),
                kept_guide.direct.get(),
                kept_guide.arrivals.get()};
    }
    KnownSamples* known() { return shared ? &shared->known : nullptr; }
};

/// Does a stage's work, timed.
template <typename Work>
auto timed(Frame& frame, const char* stage, const Work& work)
{
    return timed(frame.stats(), frame.hooks.progress, stage, work);
}

/// Plans what is to be simulated and begins with what the session keeps.
Frame begin_frame(Session& session, const Camera& camera, const RenderOptions& asked, const RenderHooks& hooks);
/// The same at the first of several moments.
Frame begin_frame(Session& session, const MomentFunction& moments, const RenderOptions& asked,
                  const RenderHooks& hooks);

// The stages of a pass, in their order; each does nothing where the plan leaves it out.

/// Goes on to the next pass, and its moment. @return false: there are enough
bool begin_pass(Frame& frame);
void draw_gbuffer(Frame& frame);
/// Light of later bounces, spread over the surfaces that gather rays can meet: once for all passes.
void spread_bounces(Frame& frame);
void light_directly(Frame& frame);
/// Finds out where the light is that rays would have to look for: once, and where the scene has moved.
void look_around(Frame& frame);
/// One round of rays along the lobes too narrow for records.
void trace_lobes(Frame& frame);
/// Holes, gathers, records; the first view's by steps to an error or for a time, if that is asked for.
void place_records(Frame& frame);
/// The same for pictures to come: without gathers at contacts, which are of one picture.
void place_plain_records(Frame& frame);
/// The coarse records of the first view alone, and what they foretell.
void forecast_records(Frame& frame);
void splat_records(Frame& frame);
/// Further rounds along narrow lobes and of direct light, as many as the error asks for.
void sample_further(Frame& frame);
void add_to_picture(Frame& frame);
/// Takes the place of the surfaces in view by what shows through them. @return false: nothing does
bool look_behind(Frame& frame);
/// Records that were left out meanwhile are back among the others.
void bring_back(Frame& frame);
/// Tells after_pass of the picture so far.
void show_picture(Frame& frame);
/// Tells after_step of the picture that the first view's records make.
void tell_step(Frame& frame, const RecordLook& look);

/// Of these records, all of them or some: light of both kinds.
struct RecordedLight {
    SplatBuffer all, of_lamps;
    SplatStats stats;
};
RecordedLight splat_light(Frame& frame, const std::vector<Record>& records);
/// What the records say beyond their own light is set anew, unless only a few have come since.
void correct_records(Frame& frame);

/// Looks at new records, so that it can be seen what changes; only if the session wants that.
void watch_records(Frame& frame);

/// Of a crop's picture that is done, or so far, its margin goes.
void cut_to_crop(const Frame& frame, LayeredImage& image);

/// The session keeps what was there, and what has come to it, of a picture that did not come about.
void give_back(Frame& frame);
/// What lasts goes to the session. @return records that it does not keep
std::vector<Record> hand_over(Frame& frame);

/// Sums become the picture, and counts its statistics.
void finish_picture(Frame& frame);
/// The same; what lasts goes back to the session.
RenderResult finish(Frame& frame);

}  // namespace rcs
