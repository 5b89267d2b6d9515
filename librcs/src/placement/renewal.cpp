#include "placement/renewal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "placement/changes_around.h"
#include "placement/refine.h"
#include "placement/spacing.h"
#include "placement/view_fit.h"
#include "rays/ray_scene_impl.h"
#include "records/gather.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// So many scenes after the last gather a record is gathered again whatever was seen; those of a picture take turns.
// demo:atrium's batch in 240 frames: MRE 3.7 % with this and with half, which takes 6 % more rays.
constexpr std::uint32_t kLife = 256;
// ... where neither it nor the records around have seen any change since.
constexpr std::uint32_t kQuietLife = 2 * kLife;
// One that is gathered again may be so much noisier than is wanted at a pixel, where several are averaged: it takes no
// more rays than for that...
constexpr float kNoisier = 1.75f;
// ... nor by more than this and so much for every other at which light does not change. Where it changes at all of
// them the picture would be as much noisier, and noise is not all that those that follow are off by: less, then, than
// what is gathered for one picture (docs/method.md, Where the scene changes).
constexpr float kNoisierAlone = 0.8f, kNoisierByOthers = 0.3f;
// Where light changes by more than this part of what it is then, no view has shown it. demo:atrium's batch with .1: as
// many rays within 1 %, and its errors.
constexpr float kShown = 0.2f;
// Of an object's extent: as near to its bounds a place is not inside.
constexpr double kRim = 0.02;

/// Whether a place is inside of the bounds of something that has moved since.
bool is_inside_moved(const RayScene& rays, const SceneStates& states, const Record& r)
{
    for (std::size_t i = 0; i < states.changed.size(); ++i) {
        if (states.changed[i] <= r.watch.state) continue;
        const Instance& instance = rays.scene().instances[i];
        const Bounds& bounds = rays.impl().bounds[static_cast<std::size_t>(instance.mesh)];
        const glm::dvec3 p =
            glm::dvec3(glm::inverse(instance.world_from_object) * glm::dvec4(glm::dvec3(r.position), 1.0));
        const glm::dvec3 rim = kRim * (bounds.max - bounds.min);
        if (glm::all(glm::greaterThan(p, bounds.min + rim)) && glm::all(glm::lessThan(p, bounds.max - rim)))
            return true;
    }
    return false;
}

/// A record that can be brought up to date: it is watched, and its surface is where it was.
bool is_watched(const SceneStates& states, const Record& r)
{
    return !r.watch.seen.empty() && r.watch.instance < states.changed.size() &&
           states.changed[r.watch.instance] <= r.watch.state;
}

/// Whether a pixel sees a place near the record, as far as it reaches.
bool is_in_view(const Renewal& n, const Record& r)
{
    const GBuffer& g = n.gbuffer;
    const glm::vec3 relative = glm::vec3(glm::dvec3(r.position) - g.camera_position);
    const std::optional<glm::dvec2> at = image_position(n.view, glm::dvec3(relative));
    if (!at) return false;
    const float reach = kNeighbourhood * r.spacing_radius;
    const double pixels = reach_in_pixels(n.view, r, static_cast<double>(reach));
    const glm::dvec2 last(g.width - 1, g.height - 1);
    for (const glm::dvec2 way :
         {glm::dvec2(0, 0), glm::dvec2(0.5, 0), glm::dvec2(-0.5, 0), glm::dvec2(0, 0.5), glm::dvec2(0, -0.5)}) {
        const glm::dvec2 wanted = glm::round(*at + pixels * way - 0.5);
        const glm::dvec2 p = glm::clamp(wanted, glm::dvec2(0.0), last);
        if (glm::distance(p, wanted) > pixels) continue;
        const std::size_t i =
            static_cast<std::size_t>(p.y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(p.x);
        if (g.covered(i) && glm::distance(g.position(i), relative) <= reach) return true;
    }
    return false;
}

/// Parts the records in those that matter, those laid aside and those that go.
/// @return numbers of those of earlier scenes among the first
std::vector<std::uint32_t> part(const Renewal& n, std::vector<Record>& records, std::vector<Record>& aside)
{
    std::vector<std::uint32_t> stale;
    std::vector<Record> kept;
    kept.reserve(records.size());
    for (Record& r : records) {
        if (r.watch.state == n.states.now) {
            kept.push_back(std::move(r));
            continue;
        }
        if (!is_watched(n.states, r) || is_inside_moved(n.scene.rays, n.states, r)) continue;
        if (is_in_view(n, r)) {
            stale.push_back(static_cast<std::uint32_t>(kept.size()));
            kept.push_back(std::move(r));
        } else {
            aside.push_back(std::move(r));
        }
    }
    records = std::move(kept);
    return stale;
}

std::uint64_t place_hash(glm::vec3 p)
{
    const std::uint64_t xy = std::uint64_t{std::bit_cast<std::uint32_t>(p.x)} << 32 | std::bit_cast<std::uint32_t>(p.y);
    return mix64(mix64(xy) ^ std::bit_cast<std::uint32_t>(p.z));
}

/// Whether its life has ended since it was last seen.
bool is_over(const Record& r, std::uint32_t seen, std::uint32_t now)
{
    const std::uint32_t life = r.watch.touched > r.watch.gathered ? kLife : kQuietLife;
    const auto turn = static_cast<std::uint32_t>(place_hash(r.position) % life);
    return (now + turn) / life != (seen + turn) / life;
}

/// Other rays than records had. Where light had come from along those has been learned: it is looked at, and what they
/// say of the rest is too dark ever since (docs/method.md, Where the scene changes).
class FreshGathers {
public:
    explicit FreshGathers(const Renewal& n) : gatherer_(n.scene, with_own_rays(n)) {}

    /// Lets a record count as few rays as its light and the change that it took on are worth.
    /// @param noise  of its light before   @param error  of the change   @param allowed  of both   @return how many
    /// gathers bring its noise back to what it was, or to what is allowed
    int make_room(Record& r, float noise, float error, float allowed) const
    {
        const float now2 = noise * noise + error * error, wanted = std::max(noise, allowed);
        const auto had = static_cast<float>(r.rays);
        const float of_one = noise * noise * had;  // variance times rays
        const float worth = of_one / now2, needed = of_one / (wanted * wanted);
        r.rays = std::max(1, static_cast<int>(worth));
        r.noise = std::sqrt(now2);
        return std::max(1, static_cast<int>(std::lround((needed - worth) / static_cast<float>(gatherer_.rays()))));
    }
    /// Averages them into records whose change is too noisy. @param more  gathers for each record
    void add(const Renewal& n, std::span<const int> more, std::vector<Record>& records, ThreadPool& pool,
             RecordStats& stats) const
    {
        const std::vector<std::uint32_t> unused(records.size());  // all know where they were born
        gatherer_.gather_more(n.gbuffer, unused, more, records, pool, stats, [](float) {});
    }
    /// Gathers records again where they are. @param which, rays  as RecordGatherer::renew() takes them
    void renew(std::vector<Record>& records, std::span<const std::uint32_t> which, std::span<const int> rays,
               ThreadPool& pool, RecordStats& stats) const
    {
        gatherer_.renew(records, which, rays, pool, stats);
    }

private:
    static RecordSettings with_own_rays(const Renewal& n)
    {
        RecordSettings settings = n.settings;
        settings.seed = stream_key(settings.seed, Stream::renewal, n.states.now);
        return settings;
    }

    RecordGatherer gatherer_;
};

/// Of records that follow a change of the scene.
struct Follow {
    std::size_t records = 0, changed = 0;  ///< that are there; those at which light has changed

    /// How much noisier than is wanted they may become.
    float noisier() const
    {
        if (changed == 0) return kNoisier;
        const float others = static_cast<float>(records - std::min(records, changed)) / static_cast<float>(changed);
        return std::min(kNoisier, kNoisierAlone + kNoisierByOthers * others);
    }
    /// ... and new ones among them: less where many have gone, whose places those take; not at all if none follow.
    float noisier_newcomers(std::size_t gone) const
    {
        if (changed == 0) return 1.0f;
        const float left = static_cast<float>(records) / static_cast<float>(records + gone);
        return 1.0f + left * (noisier() - 1.0f);
    }
};

/// What few rays saw becomes what all around saw. How light turns about is left as it was: fewer say it, and worse.
void take_mean(ChangeAround& around, Record& change)
{
    change.irradiance = around.mean;
    change.noise = around.noise;
    change.radiance = std::move(around.radiance);
    change.translation_gradient = change.rotation_gradient = {};
}

Follow count(std::span<const ChangeAround> around, std::size_t records)
{
    const auto changed = std::count_if(around.begin(), around.end(), [](const auto& c) { return c.any(); });
    return {records, static_cast<std::size_t>(changed)};
}

}  // namespace

bool are_stale(std::span<const Record> records, const SceneStates& states)
{
    return std::any_of(records.begin(), records.end(), [&](const Record& r) { return r.watch.state != states.now; });
}

float renew_records(const Renewal& n, ThreadPool& pool, std::vector<Record>& records, std::vector<Record>& aside,
                    RecordStats& stats)
{
    const std::size_t before = records.size() + aside.size();
    const std::vector<std::uint32_t> stale = part(n, records, aside);
    const std::size_t gone = before - records.size() - aside.size();
    std::vector<std::uint32_t> seen(stale.size());
    for (std::size_t k = 0; k < seen.size(); ++k) seen[k] = records[stale[k]].watch.state;
    const RecordWatcher watcher(n.scene, n.settings);
    std::vector<Record> changes = watcher.look(records, stale, n.states, pool, stats);
    std::vector<ChangeAround> around = changes_around(records, stale, changes, n.settings.error_tolerance, pool);
    const Follow follow = count(around, records.size());
    const float wanted = follow.noisier() * n.settings.noise_target;
    const float widest = n.settings.error_tolerance * n.settings.max_reach;
    std::vector<std::uint32_t> again;
    std::vector<int> rays, more(records.size(), 0);
    const FreshGathers fresh(n);
    for (std::size_t k = 0; k < seen.size(); ++k) {
        Record& r = records[stale[k]];
        ChangeAround& there = around[k];
        if (there.any()) r.watch.touched = n.states.now;
        const float allowed = wanted * noise_allowed(r, widest);
        const float noise = r.noise;
        take_mean(there, changes[k]);
        if (there.large || is_over(r, seen[k], n.states.now) || !add_change(r, changes[k])) {
            again.push_back(stale[k]);
            const float excess = noise / allowed;
            rays.push_back(static_cast<int>(static_cast<float>(r.rays) * std::min(1.0f, excess * excess)));
            continue;
        }
        if (std::abs(luminance(changes[k].irradiance)) > kShown * luminance(r.irradiance)) r.watch.is_shown = false;
        if (there.error > allowed && r.radiance.empty() == n.settings.radiance) {
            again.push_back(stale[k]);  // what this view gathers could not be averaged with it
            rays.push_back(r.rays);
        } else if (there.error > allowed) {
            more[stale[k]] = fresh.make_room(r, noise, there.error, allowed);
        }
    }
    fresh.add(n, more, records, pool, stats);
    fresh.renew(records, again, rays, pool, stats);
    trust_gradients(records, n.settings);
    for (const std::uint32_t k : again) {
        RecordWatch& watch = records[k].watch;
        watch.gathered = n.states.now;
        watch.light = luminance(records[k].irradiance);
        watch.is_shown = false;
    }
    stats.watched += stale.size();
    stats.renewed += again.size();
    return follow.noisier_newcomers(gone);
}

}  // namespace rcs
