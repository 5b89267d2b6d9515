#include "render/upkeep.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "compose/contacts.h"
#include "placement/renewal.h"
#include "records/watch.h"
#include "render/frame.h"
#include "render/light_search.h"

namespace rcs {

// Gathers at contacts that are renewed may be so much noisier than a record: they count together with those around,
// and gather more where that is too noisy for what they say (ask_contacts()). demo:atrium's batch, with 2.5: 120.2 ->
// 118.1 million rays, its errors as before; with 5 a little less yet.
constexpr float kNoisierContacts = 5.0f;

void bring_up_to_date(Frame& f)
{
    Session::State& session = f.session.state();
    if (!session.watches()) return;
    const SceneStates states = session.states();
    if (!are_stale(f.records, states)) return;
    RecordStats& stats = f.stats().records;
    const float slack = renew_records({f.lit(), f.gbuffer, f.view(), f.course.records, states}, f.session.pool(),
                                      f.records, f.aside, stats);
    // Further views of the scene find few that are behind, and where nothing is kept none is to tell of another.
    if (session.options.keep_records && !session.noise.slack) session.noise.slack = slack;
    if (f.hooks.log)
        f.hooks.log(LogLevel::debug, "of " + std::to_string(f.records.size() + f.aside.size()) +
                                         " records kept from other scenes " + std::to_string(stats.watched) +
                                         " matter here, and " + std::to_string(stats.renewed) +
                                         " of them are gathered again");
}

void renew_contacts(Frame& f)
{
    Session::State& session = f.session.state();
    if (!session.watches()) return;
    const SceneStates states = session.states();
    if (!are_stale(session.contacts, states)) return;
    // The others may be shown again later, and are looked at then.
    std::vector<Record> contacts = take_shown({f.gbuffer, f.view(), f.contacts}, session.contacts), unseen;
    RecordStats again;
    RecordSettings settings = contact_gathers(f);
    settings.noise_target *= kNoisierContacts;
    renew_records({light_at_contacts(f), f.gbuffer, f.view(), settings, states}, f.session.pool(), contacts, unseen,
                  again);
    std::move(contacts.begin(), contacts.end(), std::back_inserter(session.contacts));
    f.stats().contact_rays += again.hemisphere_rays + again.shadow_rays + again.looks;
}

namespace {

/// Those that are not watched are not stale as long as the scene stays.
void hold_in_this_scene(std::vector<Record>& records, const SceneStates& states)
{
    for (Record& r : records)
        if (r.watch.seen.empty()) r.watch.state = states.now;
}

}  // namespace

void watch_records(Frame& f)
{
    Session::State& session = f.session.state();
    if (!session.watches() || !f.needs(Effect::indirect_diffuse)) return;
    if (f.gathered.any()) {
        for (std::vector<Record>* part : {&f.records, &session.contacts}) hold_in_this_scene(*part, session.states());
        return;
    }
    timed(f, "watch", [&] {
        const LitScene lit{f.rays, f.light_cache, nullptr, &f.gathered};
        RecordStats& stats = f.stats().records;
        RecordWatcher(lit, f.course.records).begin(f.records, session.states(), f.session.pool(), stats);
        RecordWatcher(lit, contact_gathers(f)).begin(session.contacts, session.states(), f.session.pool(), stats);
    });
}

}  // namespace rcs
