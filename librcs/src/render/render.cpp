#include "rcs/render.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "render/frame.h"

namespace rcs {
namespace {

// Gautron, Krivanek, Bouatouch, Pattanaik 2005: sparse records are gathered by rays where no record serves a visible
// point yet, each is splatted over what it serves, and the normalised sum is the indirect light.
RenderResult render(Frame frame)
try {
    while (begin_pass(frame)) {
        draw_gbuffer(frame);
        spread_bounces(frame);
        do {
            light_directly(frame);
            look_around(frame);
            trace_lobes(frame);
            place_records(frame);
            splat_records(frame);
            sample_further(frame);
            add_to_picture(frame);
        } while (look_behind(frame));
        show_picture(frame);
    }
    watch_records(frame);
    return finish(frame);
} catch (...) {
    give_back(frame);
    throw;
}

}  // namespace

// Options -> plan -> settings.
RenderResult render(Session& session, const Camera& camera, const RenderOptions& asked, const RenderHooks& hooks)
{
    return render(begin_frame(session, camera, asked, hooks));
}

RenderResult render(Session& session, const MomentFunction& moments, const RenderOptions& asked,
                    const RenderHooks& hooks)
{
    return render(begin_frame(session, moments, asked, hooks));
}

void begin_watching(Session& session, const Camera& camera, const RenderOptions& asked, const RenderHooks& hooks)
{
    Frame frame = begin_frame(session, camera, asked, hooks);
    const bool of_lamps =
        std::any_of(frame.records.begin(), frame.records.end(), [](const Record& r) { return r.gathered_lamps != 0; });
    if (!of_lamps && frame.needs(Effect::indirect_diffuse) && begin_pass(frame)) {
        draw_gbuffer(frame);
        spread_bounces(frame);
        watch_records(frame);
    }
    std::move(frame.without_radiance.begin(), frame.without_radiance.end(), std::back_inserter(frame.records));
    session.begin_with(std::move(frame.records));
}

RenderStats forecast(Session& session, const Camera& camera, const RenderOptions& asked, const RenderHooks& hooks)
{
    Frame frame = begin_frame(session, camera, asked, hooks);
    try {
        if (frame.needs(Effect::indirect_diffuse) && has_goal(asked) && begin_pass(frame)) {
            draw_gbuffer(frame);
            spread_bounces(frame);
            light_directly(frame);
            look_around(frame);
            trace_lobes(frame);
            forecast_records(frame);
        }
    } catch (...) {
        give_back(frame);
        throw;
    }
    give_back(frame);
    return std::move(frame.stats());
}

RenderResult render(Scene scene, const Camera& camera, const RenderOptions& asked, const RenderHooks& hooks)
{
    Session session({.log = hooks.log});
    session.show(std::move(scene));
    return render(session, camera, asked, hooks);
}

}  // namespace rcs
