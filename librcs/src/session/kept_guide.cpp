#include "session/kept_guide.h"

#include <utility>

#include "lamps/movers.h"
#include "rays/ray_scene_impl.h"

namespace rcs {
namespace {

bool overlap(const Bounds& a, const Bounds& b)
{
    return glm::all(glm::lessThanEqual(a.min, b.max)) && glm::all(glm::lessThanEqual(b.min, a.max));
}

/// Boxes that overlap become one around both: what moves on and on leaves one.
void add(std::vector<Bounds>& boxes, Bounds box)
{
    if (!(box.min.x <= box.max.x)) return;
    for (auto other = boxes.begin(); other != boxes.end();) {
        if (!overlap(*other, box)) {
            ++other;
            continue;
        }
        box = {glm::min(box.min, other->min), glm::max(box.max, other->max)};
        boxes.erase(other);
        other = boxes.begin();
    }
    boxes.push_back(box);
}

}  // namespace

bool KeptGuide::serves(std::uint32_t scene, std::span<const SceneChange> changes, bool for_lobes)
{
    constexpr std::size_t kRecordsOfSearch = 2048;
    if (is_old()) return false;
    if (!does_without && (is_of(scene) || follow(scene, changes))) return true;
    if (for_lobes || gathered >= kRecordsOfSearch) return false;
    for (const SceneChange& change : changes)
        if (change.everywhere && change.state > scene_number) return false;
    do_without();
    return true;
}

bool KeptGuide::follow(std::uint32_t scene, std::span<const SceneChange> changes)
{
    if (!guide || direct) return false;
    std::uint32_t at = scene_number;
    for (const SceneChange& change : changes) {
        if (change.state <= at) continue;
        if (change.everywhere || change.state != at + 1) return false;
        at = change.state;
    }
    if (at != scene) return false;
    for (const SceneChange& change : changes)
        if (change.state > scene_number)
            for (const Bounds& box : change.where) add(moved, box);
    scene_number = scene;
    knows_moved = false;
    return true;
}

bool KeptGuide::leave_out(const RayScene& rays)
{
    if (std::exchange(knows_moved, true)) return true;
    return guide->leave_out(Movers(moved, *rays.impl().lights, !environment_of(rays).is_black()));
}

void KeptGuide::do_without()
{
    guide.reset(), direct.reset();
    does_without = true;
}

}  // namespace rcs
