#include "records/reach.h"

#include <algorithm>
#include <span>

namespace rcs {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
// Of the box around the scene: far more than a ray's points are off by rounding, and by their offset from surfaces.
constexpr double kRim = 1e-4;

/// Whether a ray meets a box, by slabs.
bool meets(const Bounds& box, glm::dvec3 origin, glm::dvec3 direction, double length)
{
    double begin = 0.0, end = length;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0.0) {
            if (!(origin[axis] >= box.min[axis] && origin[axis] <= box.max[axis])) return false;
            continue;
        }
        const double inverse = 1.0 / direction[axis];
        const double a = (box.min[axis] - origin[axis]) * inverse, b = (box.max[axis] - origin[axis]) * inverse;
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    return begin <= end;
}

}  // namespace

Reach::Reach(const SceneStates& states, bool cached) : now_(states.now)
{
    const glm::dvec3 size = states.box.max - states.box.min;
    const double rim = kRim * std::max({0.0, size.x, size.y, size.z});  // an empty box has a negative size
    for (auto change = states.changes.rbegin(); change != states.changes.rend() && !cached; ++change) {
        if (change->everywhere || change->state != now_ - (where_since_.size() - 1)) return;
        for (const Bounds& box : change->where)
            if (box.min.x <= box.max.x) where_.push_back({box.min - rim, box.max + rim});
        where_since_.push_back(where_.size());
    }
}

std::uint64_t Reach::rays(const RecordWatch& watch) const
{
    const std::size_t scenes = now_ - watch.state, count = watch.seen.size();
    if (scenes == 0) return 0;
    if (watch.ways.size() < count || count == 0 || scenes >= where_since_.size()) return kAll;
    const std::span<const Bounds> where = std::span(where_).first(where_since_[scenes]);
    std::uint64_t reached = 0;
    for (std::size_t i = 0; i < watch.ways.size(); ++i) {
        const WatchedWay& way = watch.ways[i];
        const std::uint64_t bit = std::uint64_t{1} << way.ray;
        if (!(way.length >= 0.0f) || (reached & bit) != 0) continue;
        glm::dvec3 origin(watch.origin);
        if (i >= count) {
            const WatchedWay& before = watch.ways[way.ray];
            origin += static_cast<double>(before.length) * glm::dvec3(before.direction);
        }
        const auto is_met = [&](const Bounds& box) {
            return meets(box, origin, glm::dvec3(way.direction), static_cast<double>(way.length));
        };
        if (std::any_of(where.begin(), where.end(), is_met)) reached |= bit;
    }
    return reached;
}

}  // namespace rcs
