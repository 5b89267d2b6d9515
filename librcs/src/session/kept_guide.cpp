#include "session/kept_guide.h"

#include <utility>

#include "lamps/movers.h"
#include "rays/ray_scene_impl.h"

namespace rcs {
namespace {

// Apart. Of more, one or the other is between any point and a lamp.
constexpr std::size_t kMostMoved = 32;

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
    std::vector<Bounds> boxes = moved;
    for (const SceneChange& change : changes) {
        if (change.state <= scene_number) continue;
        for (const Bounds& box : change.where) {
            add(boxes, box);
            if (boxes.size() > kMostMoved) return false;
        }
    }
    moved = std::move(boxes);
    scene_number = scene;
    knows_moved = false;
    return true;
}

bool KeptGuide::leave_out(const RayScene& rays, ThreadPool& pool)
{
    // Rays ask of every place that they meet.
    constexpr std::size_t kMostPairs = 32;
    if (std::exchange(knows_moved, true)) return true;
    const Lights& lights = *rays.impl().lights;
    return moved.size() * lights.triangles.size() <= kMostPairs &&
           guide->leave_out(Movers(moved, lights, !environment_of(rays).is_black()), pool);
}

}  // namespace rcs
