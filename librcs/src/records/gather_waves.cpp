#include "records/gather_waves.h"

#include <algorithm>
#include <utility>

namespace rcs {
namespace {

constexpr std::size_t kRecordsAtATime = 4;

void take_yield(GatherWorkspace& w, GatherYield& yield)
{
    yield.hemisphere_rays += std::exchange(w.hemisphere_rays, 0);
    yield.aimed_rays += std::exchange(w.aimed.rays, 0);
    yield.shadow_rays += std::exchange(w.shadow_rays, 0);
    yield.looks += std::exchange(w.looks_shot, 0);
    yield.seen.insert(yield.seen.end(), w.looks.begin(), w.looks.end());
    w.looks.clear();
    for (Arrivals a : w.aimed.gathers) {
        a.first += static_cast<std::uint32_t>(yield.arrived.size());
        yield.gathers.push_back(a);
    }
    yield.arrived.insert(yield.arrived.end(), w.aimed.arrived.begin(), w.aimed.arrived.end());
    w.aimed.gathers.clear();
    w.aimed.arrived.clear();
}

/// Gathers that are made together, each in memory of its own.
class Wave {
public:
    /// @param size  tasks at the most
    Wave(const Gatherer& gatherer, RayCaster& caster, std::size_t size, int most_cells, ThreadPool& pool)
        : gatherer_(gatherer), caster_(caster), pool_(pool), workspaces_(size, GatherWorkspace(most_cells))
    {
    }

    void begin(std::vector<GatherTask> tasks)
    {
        tasks_ = std::move(tasks);
        each([&](const GatherTask& t, GatherWorkspace& w, std::size_t) { gatherer_.aim(t.birth, *t.size, w); });
    }

    void trace_and_shade()
    {
        aimed_.clear();
        for (std::size_t i = 0; i < tasks_.size(); ++i)
            for (const PacketCells& cells : workspaces_[i].cells) {
                const std::size_t p = cells.first / RayPacket::kWidth;
                aimed_.push_back({&workspaces_[i].packets[p], &workspaces_[i].weights[p], cells.active});
            }
        caster_.intersect(aimed_, pool_);
        each([&](const GatherTask& t, GatherWorkspace& w, std::size_t) { gatherer_.shade(t.birth, w); });
    }

    template <typename Keep>
    void finish(std::size_t first, const Keep& keep, GatherYield& yield)
    {
        batches_.clear();
        for (std::size_t i = 0; i < tasks_.size(); ++i)
            for (ShadowBatch* batch : {&workspaces_[i].shadow, &workspaces_[i].look_rays})
                if (batch->size() > 0) batches_.push_back(batch);
        caster_.trace(batches_, pool_);
        each([&](const GatherTask& t, GatherWorkspace& w, std::size_t i) {
            keep(first + i, gatherer_.finish(t.birth, *t.size, w), w);
        });
        for (std::size_t i = 0; i < tasks_.size(); ++i) take_yield(workspaces_[i], yield);
    }

private:
    template <typename Work>
    void each(const Work& work)
    {
        pool_.parallel_for(tasks_.size(), kRecordsAtATime, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t i = begin; i < end; ++i) work(tasks_[i], workspaces_[i], i);
        });
    }

    const Gatherer& gatherer_;
    RayCaster& caster_;
    ThreadPool& pool_;
    std::vector<GatherWorkspace> workspaces_;
    std::vector<GatherTask> tasks_;
    std::vector<AimedPacket> aimed_;
    std::vector<ShadowBatch*> batches_;
};

}  // namespace

void GatherYield::count(RecordStats& stats) const
{
    stats.hemisphere_rays += hemisphere_rays;
    stats.aimed_rays += aimed_rays;
    stats.shadow_rays += shadow_rays;
    stats.looks += looks;
}

GatherYield gather_each(const Gatherer& gatherer, RayCaster* caster, std::size_t count, int most_cells,
                        const std::function<GatherTask(std::size_t)>& task, ThreadPool& pool,
                        const std::function<void(std::size_t, Record&&, const GatherWorkspace&)>& keep)
{
    GatherYield yield;
    if (caster && caster->works()) {
        const std::size_t at_once =
            std::min(count, std::max<std::size_t>(1, caster->wave() / static_cast<std::size_t>(most_cells)));
        Wave wave(gatherer, *caster, at_once, most_cells, pool);
        for (std::size_t first = 0; first < count; first += at_once) {
            std::vector<GatherTask> tasks;
            for (std::size_t i = first; i < std::min(count, first + at_once); ++i) tasks.push_back(task(i));
            wave.begin(std::move(tasks));
            wave.trace_and_shade();
            wave.finish(first, keep, yield);
        }
        return yield;
    }
    std::vector<GatherWorkspace> workspaces(static_cast<std::size_t>(pool.size()), GatherWorkspace(most_cells));
    pool.parallel_for(count, kRecordsAtATime, [&](std::size_t begin, std::size_t end, int thread) {
        GatherWorkspace& w = workspaces[static_cast<std::size_t>(thread)];
        for (std::size_t i = begin; i < end; ++i) {
            const GatherTask t = task(i);
            keep(i, gatherer.gather(t.birth, *t.size, w), w);
        }
    });
    for (GatherWorkspace& w : workspaces) take_yield(w, yield);
    return yield;
}

}  // namespace rcs
