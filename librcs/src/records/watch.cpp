#include "records/watch.h"

#include <algorithm>
#include <cmath>

#include "records/gatherer.h"
#include "records/reach.h"
#include "util/color.h"

namespace rcs {
namespace {

// Of a look. Twice as many would cost twice as much, and leave 0.7 of the noise of what has changed.
constexpr int kLookRays = 32;  // a word numbers its cells: 64 at the most, and 64 rays would be 65
// Streams of their own, whatever the seed of the view: looks of different views are compared.
constexpr std::uint64_t kSeed = 0x77617463;

constexpr std::uint64_t kAllRays = ~std::uint64_t{0};

/// Those of the rays that were shot take the place of what they were; shadow rays of all others stay.
void take_ways(const GatherWorkspace& w, RecordWatch& watch)
{
    const std::size_t count = watch.seen.size();
    const auto is_shot = [&](std::uint32_t ray) { return (w.wanted >> ray & 1u) != 0u; };
    watch.ways.resize(std::max(watch.ways.size(), count));
    for (std::size_t c = 0; c < count; ++c)
        if (is_shot(static_cast<std::uint32_t>(c))) watch.ways[c] = w.ways[c];
    const auto shadows = watch.ways.begin() + static_cast<std::ptrdiff_t>(count);
    watch.ways.erase(std::remove_if(shadows, watch.ways.end(), [&](const WatchedWay& s) { return is_shot(s.ray); }),
                     watch.ways.end());
    watch.ways.insert(watch.ways.end(), w.shadow_ways.begin(), w.shadow_ways.end());
}

}  // namespace

struct RecordWatcher::Impl {
    Gatherer gatherer;
    HemisphereGrid grid = make_hemisphere_grid(kLookRays);
    bool cached;

    Impl(const LitScene& scene, const RecordSettings& options)
        : gatherer({scene.rays, options.bounces > 1 ? scene.cache : nullptr, nullptr, scene.gathered}, options),
          cached(options.bounces > 1)
    {
    }

    /// Looks at each of the records. @param rays  which of its rays are shot, bit by number; nothing has changed for
    /// the others   @param keep  (number in `which`, difference)
    template <typename Keep>
    void look(std::span<Record> records, std::span<const std::uint32_t> which, std::span<const std::uint64_t> rays,
              const SceneStates& states, ThreadPool& pool, RecordStats& stats, const Keep& keep) const
    {
        std::vector<GatherWorkspace> workspaces(static_cast<std::size_t>(pool.size()), GatherWorkspace(grid.cells));
        for (GatherWorkspace& w : workspaces) w.keeps_ways = true;
        pool.parallel_for(which.size(), 16, [&](std::size_t begin, std::size_t end, int thread) {
            for (std::size_t i = begin; i < end; ++i) {
                Record& r = records[which[i]];
                GatherWorkspace& w = workspaces[static_cast<std::size_t>(thread)];
                r.watch.seen.resize(static_cast<std::size_t>(grid.cells), glm::vec3(0.0f));
                w.wanted = rays[i];
                keep(i, gatherer.difference(birth_of(r, kSeed), grid, r.watch.seen, w));
                take_ways(w, r.watch);
                r.watch.state = states.now;
            }
        });
        for (const GatherWorkspace& w : workspaces) {
            stats.hemisphere_rays += w.hemisphere_rays;
            stats.shadow_rays += w.shadow_rays;
        }
    }
};

RecordWatcher::RecordWatcher(const LitScene& scene, const RecordSettings& options) : impl_(new Impl(scene, options)) {}
RecordWatcher::~RecordWatcher() = default;

void RecordWatcher::begin(std::span<Record> records, const SceneStates& states, ThreadPool& pool,
                          RecordStats& stats) const
{
    std::vector<std::uint32_t> fresh;
    const std::span<const std::uint32_t> moving = states.in_motion();
    for (std::size_t i = 0; i < records.size(); ++i) {
        RecordWatch& watch = records[i].watch;
        if (!watch.seen.empty() || watch.geometric_normal == glm::vec3(0.0f)) continue;
        watch.gathered = states.now;
        watch.light = luminance(records[i].irradiance);
        // What has just moved mostly goes on, and its records with it: they hold in this scene alone.
        if (std::binary_search(moving.begin(), moving.end(), watch.instance)) {
            watch.state = states.now;
            continue;
        }
        fresh.push_back(static_cast<std::uint32_t>(i));
    }
    impl_->look(records, fresh, std::vector<std::uint64_t>(fresh.size(), kAllRays), states, pool, stats,
                [](std::size_t, const Record&) {});
}

std::vector<Record> RecordWatcher::look(std::span<Record> records, std::span<const std::uint32_t> which,
                                        const SceneStates& states, ThreadPool& pool, RecordStats& stats) const
{
    std::vector<Record> changes(which.size());
    const Reach reach(states, impl_->cached);
    std::vector<std::uint64_t> reach_of(which.size());
    std::vector<Reach::Ways> ways(static_cast<std::size_t>(pool.size()));
    pool.parallel_for(which.size(), 64, [&](std::size_t begin, std::size_t end, int thread) {
        for (std::size_t i = begin; i < end; ++i) {
            RecordWatch& watch = records[which[i]].watch;
            reach_of[i] = reach.rays(watch, ways[static_cast<std::size_t>(thread)]);
            watch.state = states.now;
        }
    });
    std::vector<std::uint32_t> reached, number;
    std::vector<std::uint64_t> rays;
    for (std::size_t i = 0; i < which.size(); ++i) {
        if (reach_of[i] == 0) continue;
        rays.push_back(reach_of[i]);
        reached.push_back(which[i]);
        number.push_back(static_cast<std::uint32_t>(i));
    }
    impl_->look(records, reached, rays, states, pool, stats,
                [&](std::size_t i, Record&& change) { changes[number[i]] = std::move(change); });
    stats.looked_again += reached.size();
    return changes;
}

bool add_change(Record& record, const Record& change)
{
    const glm::vec3 sum = record.irradiance + change.irradiance;
    if (!(std::min({sum.r, sum.g, sum.b}) >= 0.0f)) return false;
    const float error = std::hypot(record.noise * luminance(record.irradiance), change.noise);
    record.irradiance = sum;
    for (std::size_t color = 0; color < 3; ++color) {
        record.rotation_gradient[color] += change.rotation_gradient[color];
        record.translation_gradient[color] += change.translation_gradient[color];
    }
    for (std::size_t k = 0; k < std::min(record.radiance.size(), change.radiance.size()); ++k)
        record.radiance[k] += change.radiance[k];
    if (change.noise > 0.0f) {  // else to the bit as it was
        const float e = luminance(sum);
        record.noise = e > 0.0f ? std::min(1.0f, error / e) : 0.0f;
    }
    return true;
}

}  // namespace rcs
