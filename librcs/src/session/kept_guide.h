#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "cells/direct_cells.h"
#include "glossy/lobe_trial.h"
#include "lit_points/arrival_map.h"
#include "lit_points/gather_guide.h"
#include "rcs/scene.h"
#include "rcs/thread_pool.h"
#include "records/watch.h"

namespace rcs {

/// Where records look for light, as it was found for one view: as good for those nearby.
struct KeptGuide {
    std::unique_ptr<GatherGuide> guide;    ///< null: looks did no good
    std::unique_ptr<DirectCells> direct;   ///< null: to know the light where rays end did none
    std::unique_ptr<ArrivalMap> arrivals;  ///< null: to aim rays did none
    WorthwhileLooks looks_of_lobes = {};   ///< at the guide's points
    int views = 0;                         ///< that it has served
    double made = 0.0;                     ///< records after the first view's, over those that there were
    std::uint32_t scene_number = 0;        ///< that points and cells are lit as in; the rest is about as good in others
    std::vector<Bounds> moved = {};        ///< around what has moved since the search; they are apart
    bool knows_moved = true;               ///< the guide does

    /// Its points lie where views up to then looked, and what was learned of who sees them from there. Where views
    /// hardly need records, there is nothing to win by another.
    bool is_old() const
    {
        constexpr double kFewMade = 0.25;
        return views >= kManyViews && made > kFewMade;
    }
    static constexpr int kManyViews = 16;
    /// Counts a view; after many, other lobes may be in view. @return whether that was the first
    bool end_view()
    {
        if (++views % kManyViews == 0) looks_of_lobes.is_sure = false;
        return views == 1;
    }
    bool knows() const { return guide || direct || arrivals; }
    bool is_of(std::uint32_t scene) const { return scene_number == scene || !(guide || direct); }
    /// Whether it serves another view.
    bool serves(std::uint32_t scene, std::span<const SceneChange> changes)
    {
        return !is_old() && (is_of(scene) || follow(scene, changes));
    }
    /// Goes to another scene if things have moved and nothing else is different, and notes around what; it has to be
    /// left out of the guide then (leave_out()). @return whether it is there now
    bool follow(std::uint32_t scene, std::span<const SceneChange> changes);
    /// Leaves what has moved out of the guide, if it does not know. @return whether enough of it remains
    bool leave_out(const RayScene& rays, ThreadPool& pool);
};

}  // namespace rcs
