#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "device/ray_caster.h"
#include "rcs/records.h"
#include "rcs/thread_pool.h"
#include "records/gatherer.h"

namespace rcs {

/// One of many gathers.
struct GatherTask {
    Birth birth;
    const GatherSize* size;
};

/// What many gathers took, and what their looks found.
struct GatherYield {
    std::uint64_t hemisphere_rays = 0, aimed_rays = 0, shadow_rays = 0, looks = 0;
    // In the order of the tasks if a caster is used, else in any:
    std::vector<Look> seen;
    std::vector<Arrivals> gathers;  ///< their rays are in `arrived`
    std::vector<ArrivedRay> arrived;

    /// Adds the rays to the statistics.
    void count(RecordStats& stats) const;
};

/// Gathers so many times, each thread a record at a time, or with a caster in waves.
/// @param caster  null, or one that no longer works: the processor traces all rays
/// @param most_cells  of the largest grid   @param task  by number; called from any thread
/// @param keep  takes a task's record and the memory that it was made in; called from any thread
GatherYield gather_each(const Gatherer& gatherer, RayCaster* caster, std::size_t count, int most_cells,
                        const std::function<GatherTask(std::size_t)>& task, ThreadPool& pool,
                        const std::function<void(std::size_t, Record&&, const GatherWorkspace&)>& keep);

}  // namespace rcs
