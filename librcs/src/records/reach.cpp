#include "records/reach.h"

#include <algorithm>
#include <span>

#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
// Of the box around the scene: far more than a ray's points are off by rounding, and by their offset from surfaces.
constexpr double kRim = 1e-4;

/// Whether each way meets a box, by slabs.
RCS_MULTIVERSION
void find_met(const Bounds& box, const Reach::Ways& ways, std::uint8_t* met)
{
    const glm::vec3 low(box.min), high(box.max);
    const float *ox = ways.origin[0].data(), *oy = ways.origin[1].data(), *oz = ways.origin[2].data();
    const float *dx = ways.direction[0].data(), *dy = ways.direction[1].data(), *dz = ways.direction[2].data();
    const float* length = ways.length.data();
    const std::size_t count = ways.count;
    for (std::size_t i = 0; i < count; ++i) {
        // Of a slab along the ray both are infinite: of one sign beside it, of two within, not a number at its rim.
        const float ix = 1.0f / dx[i], iy = 1.0f / dy[i], iz = 1.0f / dz[i];
        const float ax = (low.x - ox[i]) * ix, bx = (high.x - ox[i]) * ix;
        const float ay = (low.y - oy[i]) * iy, by = (high.y - oy[i]) * iy;
        const float az = (low.z - oz[i]) * iz, bz = (high.z - oz[i]) * iz;
        float begin = 0.0f, end = length[i];
        begin = std::max(begin, std::min(ax, bx));
        end = std::min(end, std::max(ax, bx));
        begin = std::max(begin, std::min(ay, by));
        end = std::min(end, std::max(ay, by));
        begin = std::max(begin, std::min(az, bz));
        end = std::min(end, std::max(az, bz));
        met[i] = begin <= end ? 1 : 0;
    }
}

/// Those of the ways that are shot.
void fill(const RecordWatch& watch, Reach::Ways& ways)
{
    const std::size_t count = watch.seen.size(), most = watch.ways.size();
    if (ways.length.size() < most) {
        for (int axis = 0; axis < 3; ++axis) ways.origin[axis].resize(most), ways.direction[axis].resize(most);
        ways.length.resize(most), ways.ray.resize(most), ways.met.resize(most);
    }
    float *ox = ways.origin[0].data(), *oy = ways.origin[1].data(), *oz = ways.origin[2].data();
    float *dx = ways.direction[0].data(), *dy = ways.direction[1].data(), *dz = ways.direction[2].data();
    float* const length = ways.length.data();
    std::uint8_t* const ray = ways.ray.data();
    const WatchedWay* const from = watch.ways.data();
    std::size_t n = 0;
    const auto put = [&](glm::vec3 origin, const WatchedWay& way) {
        ox[n] = origin.x, oy[n] = origin.y, oz[n] = origin.z;
        dx[n] = way.direction.x, dy[n] = way.direction.y, dz[n] = way.direction.z;
        length[n] = way.length;
        ray[n++] = static_cast<std::uint8_t>(way.ray);
    };
    const glm::vec3 origin = watch.origin;
    for (std::size_t i = 0; i < count; ++i)
        if (from[i].length >= 0.0f) put(origin, from[i]);
    for (std::size_t i = count; i < most; ++i) {
        const WatchedWay& before = from[from[i].ray];
        if (from[i].length >= 0.0f) put(origin + before.length * before.direction, from[i]);
    }
    ways.count = n;
}

/// Those of which any way is met, bit by number.
std::uint64_t rays_met(const Reach::Ways& ways)
{
    std::uint64_t reached = 0;
    for (std::size_t i = 0; i < ways.count; ++i) reached |= std::uint64_t{ways.met[i]} << ways.ray[i];
    return reached;
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

std::uint64_t Reach::rays(const RecordWatch& watch, Ways& ways) const
{
    const std::size_t scenes = now_ - watch.state, count = watch.seen.size();
    if (scenes == 0) return 0;
    if (watch.ways.size() < count || count == 0 || scenes >= where_since_.size()) return kAll;
    const std::span<const Bounds> where = std::span(where_).first(where_since_[scenes]);
    if (where.empty()) return 0;
    Bounds around;
    for (const Bounds& box : where)
        around.min = glm::min(around.min, box.min), around.max = glm::max(around.max, box.max);
    fill(watch, ways);
    find_met(around, ways, ways.met.data());
    std::uint64_t reached = rays_met(ways);
    if (reached == 0 || where.size() == 1) return reached;
    reached = 0;
    for (const Bounds& box : where) {
        find_met(box, ways, ways.met.data());
        reached |= rays_met(ways);
    }
    return reached;
}

}  // namespace rcs
