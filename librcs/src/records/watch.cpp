#include "records/watch.h"

#include <algorithm>
#include <cmath>

#include "records/gatherer.h"
#include "util/color.h"

namespace rcs {
namespace {

// Of a look. Twice as many would cost twice as much, and leave 0.7 of the noise of what has changed.
constexpr int kRays = 32;
// Streams of their own, whatever the seed of the view: looks of different views are compared.
constexpr std::uint64_t kSeed = 0x77617463;

}  // namespace

struct RecordWatcher::Impl {
    Gatherer gatherer;
    HemisphereGrid grid = make_hemisphere_grid(kRays);

    Impl(const LitScene& scene, const RecordSettings& options)
        : gatherer({scene.rays, options.bounces > 1 ? scene.cache : nullptr, nullptr, scene.gathered}, options)
    {
    }

    /// Looks at each of the records. @param keep  (number in `which`, difference)
    template <typename Keep>
    void look(std::span<Record> records, std::span<const std::uint32_t> which, std::uint32_t state, ThreadPool& pool,
              RecordStats& stats, const Keep& keep) const
    {
        std::vector<GatherWorkspace> workspaces(static_cast<std::size_t>(pool.size()), GatherWorkspace(grid.cells));
        pool.parallel_for(which.size(), 16, [&](std::size_t begin, std::size_t end, int thread) {
            for (std::size_t i = begin; i < end; ++i) {
                Record& r = records[which[i]];
                r.watch.seen.resize(static_cast<std::size_t>(grid.cells), glm::vec3(0.0f));
                keep(i, gatherer.difference(birth_of(r, kSeed), grid, r.watch.seen,
                                            workspaces[static_cast<std::size_t>(thread)]));
                r.watch.state = state;
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

void RecordWatcher::begin(std::span<Record> records, std::uint32_t state, ThreadPool& pool, RecordStats& stats) const
{
    std::vector<std::uint32_t> fresh;
    for (std::size_t i = 0; i < records.size(); ++i) {
        RecordWatch& watch = records[i].watch;
        if (!watch.seen.empty() || watch.geometric_normal == glm::vec3(0.0f)) continue;
        watch.gathered = state;
        fresh.push_back(static_cast<std::uint32_t>(i));
    }
    impl_->look(records, fresh, state, pool, stats, [](std::size_t, const Record&) {});
}

std::vector<Record> RecordWatcher::look(std::span<Record> records, std::span<const std::uint32_t> which,
                                        std::uint32_t state, ThreadPool& pool, RecordStats& stats) const
{
    std::vector<Record> changes(which.size());
    impl_->look(records, which, state, pool, stats,
                [&](std::size_t i, Record&& change) { changes[i] = std::move(change); });
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
