#include "records/reach.h"

#include <algorithm>
#include <span>

namespace rcs {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
// Of the box around the scene: far more than a ray's points are off by rounding, and by their offset from surfaces.
constexpr double kRim = 1e-4;

struct Way {
    glm::dvec3 origin, inverse;  ///< 1 / direction
    double length;
};

/// Whether it meets a box, by slabs.
inline bool meets(const Bounds& box, const Way& way)
{
    double begin = 0.0, end = way.length;
    for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.min[axis] - way.origin[axis]) * way.inverse[axis];
        const double b = (box.max[axis] - way.origin[axis]) * way.inverse[axis];
        // Of a slab along the ray both are infinite: of one sign beside it, of two within, not a number at its rim.
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
    Bounds around;
    for (const Bounds& box : where)
        around.min = glm::min(around.min, box.min), around.max = glm::max(around.max, box.max);
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
        const Way along{origin, 1.0 / glm::dvec3(way.direction), static_cast<double>(way.length)};
        const auto is_met = [&](const Bounds& box) { return meets(box, along); };
        if (meets(around, along) && std::any_of(where.begin(), where.end(), is_met)) reached |= bit;
    }
    return reached;
}

}  // namespace rcs
