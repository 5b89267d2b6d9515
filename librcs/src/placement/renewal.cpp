#include "placement/renewal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "placement/refine.h"
#include "placement/spacing.h"
#include "placement/view_fit.h"
#include "rays/ray_scene_impl.h"
#include "records/gather.h"
#include "splat/at_pixels.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// A change beyond this part of the light is no mere correction: spacing rests on the light as it was.
// With .5 a lamp that goes off left 3 % of the light behind (renewal_test).
constexpr float kMostChange = 0.3f;
// Where it is darker than this part of the mean, changes are judged as if it were as bright: they can hardly be seen.
constexpr float kDarkChange = 0.01f;
// So many scenes after the last gather a record is gathered again whatever was seen; those of a picture take turns.
constexpr std::uint32_t kLife = 128;
// ... where neither it nor the records around have seen any change since.
constexpr std::uint32_t kQuietLife = 256;
// One that is gathered again may be so much noisier than is wanted at a pixel, where several are averaged: it takes no
// more rays than for that...
constexpr float kNoisier = 1.75f;
// ... nor is the mean of all to be noisier than by so much, where light changes at most of them.
constexpr float kNoisierMean = 0.3f;
// Records are born less noisy than that: they will follow changes, too, and pictures are to be as good when those of
// the first picture are gone. Were those noisier, too, demo:atrium's frames would have 7 % more error than single
// renders with 1/3 here, 19 % with 1.
constexpr float kOfNewOnes = 0.4f;
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

/// A pixel that sees a place near the record, as far as it reaches.
std::optional<std::uint32_t> pixel_near(const Renewal& n, const Record& r)
{
    const GBuffer& g = n.gbuffer;
    const glm::vec3 relative = glm::vec3(glm::dvec3(r.position) - g.camera_position);
    const std::optional<glm::dvec2> at = image_position(n.view, glm::dvec3(relative));
    if (!at) return std::nullopt;
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
        if (g.covered(i) && glm::distance(g.position(i), relative) <= reach) return static_cast<std::uint32_t>(i);
    }
    return std::nullopt;
}

/// Those of earlier scenes that matter here, and a pixel near each.
struct Stale {
    std::vector<std::uint32_t> records, pixels;
};

/// Parts the records in those that matter, those laid aside and those that go.
Stale part(const Renewal& n, std::vector<Record>& records, std::vector<Record>& aside)
{
    Stale stale;
    std::vector<Record> kept;
    kept.reserve(records.size());
    for (Record& r : records) {
        if (r.watch.state == n.states.now) {
            kept.push_back(std::move(r));
            continue;
        }
        if (!is_watched(n.states, r) || is_inside_moved(n.scene.rays, n.states, r)) continue;
        if (const auto pixel = pixel_near(n, r)) {
            stale.records.push_back(static_cast<std::uint32_t>(kept.size()));
            stale.pixels.push_back(*pixel);
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

/// What the records around each say of its change, too: light that few rays find would else be missed by most.
class ChangesAround {
public:
    ChangesAround(const Renewal& n, std::span<const Record> records, const Stale& stale,
                  std::span<const Record> changes, ThreadPool& pool)
    {
        for (const Record& r : records) mean_ += static_cast<double>(luminance(r.irradiance));
        mean_ = std::max(mean_ / static_cast<double>(std::max<std::size_t>(1, records.size())), 1e-30);
        std::vector<Record> as_records(stale.records.size());
        for (std::size_t k = 0; k < as_records.size(); ++k) {
            const Record& r = records[stale.records[k]];
            const float change = relative(luminance(changes[k].irradiance)), error = relative(changes[k].noise);
            as_records[k].position = r.position;
            as_records[k].normal = r.normal;
            as_records[k].irradiance = {relative(luminance(r.irradiance)), error * error, change * change};
            as_records[k].spacing_radius = r.spacing_radius;
        }
        sums_ = splat_at_pixels(as_records, n.gbuffer, stale.pixels, n.view,
                                {n.settings.error_tolerance, kNeighbourhood, false}, pool);
    }

    struct Part {
        float change, error;  ///< of the light
    };
    /// @param k  of `stale`
    Part at(std::size_t k, const Record& r, const Record& change) const
    {
        const float e = relative(luminance(r.irradiance)) + kDarkChange;
        Part part{relative(std::abs(luminance(change.irradiance))) / e, relative(change.noise) / e};
        if (const float weight = sums_.weight[k]; weight > 0.0f) {
            const float around = sums_.weighted[k].x / weight + kDarkChange;
            part.error = std::max(part.error, std::sqrt(std::max(0.0f, sums_.weighted[k].y / weight)) / around);
            part.change = std::max(part.change, std::sqrt(std::max(0.0f, sums_.weighted[k].z / weight)) / around);
        }
        return part;
    }

private:
    float relative(float light) const { return static_cast<float>(static_cast<double>(light) / mean_); }

    double mean_ = 0.0;
    PixelSums sums_;
};

/// Of records whose change is too noisy: other rays than they had, so that both can be averaged.
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
    /// @param more  gathers for each record
    void add(const Renewal& n, std::span<const int> more, std::vector<Record>& records, ThreadPool& pool,
             RecordStats& stats) const
    {
        const std::vector<std::uint32_t> unused(records.size());  // all know where they were born
        gatherer_.gather_more(n.gbuffer, unused, more, records, pool, stats, [](float) {});
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
        return std::min(kNoisier, 1.0f + kNoisierMean * static_cast<float>(records) / static_cast<float>(changed));
    }
    /// ... and new ones among them: less where many have gone, whose places those take; not at all if none follow.
    float noisier_newcomers(std::size_t gone) const
    {
        if (changed == 0) return 1.0f;
        const float left = static_cast<float>(records) / static_cast<float>(records + gone);
        return 1.0f + kOfNewOnes * left * (noisier() - 1.0f);
    }
};

Follow count(std::span<const ChangesAround::Part> parts, std::size_t records)
{
    const auto changed = std::count_if(parts.begin(), parts.end(), [](const auto& p) { return p.change > 0.0f; });
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
    const Stale stale = part(n, records, aside);
    const std::size_t gone = before - records.size() - aside.size();
    std::vector<std::uint32_t> seen(stale.records.size());
    for (std::size_t k = 0; k < seen.size(); ++k) seen[k] = records[stale.records[k]].watch.state;
    const RecordWatcher watcher(n.scene, n.settings);
    const std::vector<Record> changes = watcher.look(records, stale.records, n.states, pool, stats);
    const ChangesAround around(n, records, stale, changes, pool);
    std::vector<ChangesAround::Part> parts(seen.size());
    for (std::size_t k = 0; k < seen.size(); ++k) parts[k] = around.at(k, records[stale.records[k]], changes[k]);
    const Follow follow = count(parts, records.size());
    const float wanted = follow.noisier() * n.settings.noise_target;
    const float widest = n.settings.error_tolerance * n.settings.max_reach;
    std::vector<std::uint32_t> again;
    std::vector<int> rays, more(records.size(), 0);
    const FreshGathers fresh(n);
    for (std::size_t k = 0; k < seen.size(); ++k) {
        Record& r = records[stale.records[k]];
        const ChangesAround::Part& part = parts[k];
        if (part.change > 0.0f) r.watch.touched = n.states.now;
        const float allowed = wanted * noise_allowed(r, widest);
        const float noise = r.noise;
        if (part.change > kMostChange || is_over(r, seen[k], n.states.now) || !add_change(r, changes[k])) {
            again.push_back(stale.records[k]);
            const float excess = noise / allowed;
            rays.push_back(static_cast<int>(static_cast<float>(r.rays) * std::min(1.0f, excess * excess)));
        } else if (part.error > allowed && r.radiance.empty() == n.settings.radiance) {
            again.push_back(stale.records[k]);  // what this view gathers could not be averaged with it
            rays.push_back(r.rays);
        } else if (part.error > allowed) {
            more[stale.records[k]] = fresh.make_room(r, noise, part.error, allowed);
        }
    }
    fresh.add(n, more, records, pool, stats);
    RecordGatherer(n.scene, n.settings).renew(records, again, rays, pool, stats);
    trust_gradients(records, n.settings);
    for (const std::uint32_t k : again) records[k].watch.gathered = n.states.now;
    stats.watched += stale.records.size();
    stats.renewed += again.size();
    return follow.noisier_newcomers(gone);
}

}  // namespace rcs
