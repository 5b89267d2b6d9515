#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "records/aimed_rays.h"
#include "records/gatherer.h"
#include "util/multiversion.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kLanes = RayPacket::kWidth;
constexpr int kMostWanted = 64;  // bits

/// Cells first .. first + 15 as rays of a packet; `above` becomes the cosine to the geometric normal.
RCS_MULTIVERSION
void fill_rays(const Basis& frame, const Birth& birth, const float* x, const float* y, const float* z, RayPacket& ray,
               float* above)
{
    const glm::vec3 ng = birth.geometric_normal;
    RCS_INDEPENDENT_LOOP
    for (int i = 0; i < kLanes; ++i) {
        ray.origin_x[i] = birth.origin.x;
        ray.origin_y[i] = birth.origin.y;
        ray.origin_z[i] = birth.origin.z;
        ray.t_max[i] = std::numeric_limits<float>::infinity();
        const float dx = frame.x.x * x[i] + frame.y.x * y[i] + frame.z.x * z[i];
        const float dy = frame.x.y * x[i] + frame.y.y * y[i] + frame.z.y * z[i];
        const float dz = frame.x.z * x[i] + frame.y.z * y[i] + frame.z.z * z[i];
        ray.direction_x[i] = dx;
        ray.direction_y[i] = dy;
        ray.direction_z[i] = dz;
        above[i] = dx * ng.x + dy * ng.y + dz * ng.z;
    }
}

/// Fills the packet of the cells from `first` on. @param count  of all cells
PacketCells fill_packet(const Birth& birth, GatherWorkspace& w, int first, int count)
{
    const std::size_t c = static_cast<std::size_t>(first);
    float above[kLanes];
    fill_rays(w.frame, birth, w.x.data() + c, w.y.data() + c, w.z.data() + c, w.packets[c / kLanes].ray, above);
    PacketCells cells{c, std::min(kLanes, count - first)};
    for (int i = 0; i < cells.count; ++i) cells.active |= static_cast<std::uint32_t>(above[i] > 0.0f) << i;
    return cells;
}

/// @param first, end  of the cells whose rays are shot
void add_packets(const Birth& birth, int first, int end, GatherWorkspace& w)
{
    for (; first < end; first += kLanes) {
        PacketCells& cells = w.cells.emplace_back(fill_packet(birth, w, first, end));
        if (first < kMostWanted) cells.active &= static_cast<std::uint32_t>(w.wanted >> first);
        w.hemisphere_rays += static_cast<std::uint64_t>(std::popcount(cells.active));
    }
}

/// What the record's cells lie in.
Basis frame_of(const Birth& birth)
{
    return Basis(birth.normal, to_unit_float(static_cast<std::uint32_t>(mix64(birth.key + 2))));
}

}  // namespace

void Gatherer::aim_cells(const Birth& birth, const HemisphereGrid& grid, GatherWorkspace& w) const
{
    w.frame = frame_of(birth);
    RandomStream random(birth.key);
    const glm::vec2 shift(random.next(), random.next());
    // A cell spans pi / (M N cos theta) of solid angle.
    w.cell_width = std::sqrt(std::numbers::pi_v<float> / static_cast<float>(grid.cells));
    w.least_hit_alpha = least_hit_alpha(grid.cells);
    hemisphere_directions(grid, shift, w.x.data(), w.y.data(), w.z.data());
    w.cells.clear();
    add_packets(birth, 0, grid.cells, w);
}

void Gatherer::trace_cells(GatherWorkspace& w) const
{
    for (const PacketCells& cells : w.cells) {
        const std::size_t packet = cells.first / kLanes;
        intersect(rays_, cells.active, w.packets[packet], w.weights[packet]);
    }
}

void Gatherer::aim(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const
{
    aim_cells(birth, size.grid, w);
    w.aimed.scale.clear();
    if (map_) note_bins(size, w);
    if (map_ && size.aimed > 0) {
        aim_by_map(*map_, birth, size, w);
        const std::uint64_t before = w.hemisphere_rays;
        add_packets(birth, size.first_aimed(), size.cells(), w);
        w.aimed.rays += w.hemisphere_rays - before;
    }
    w.look_rays.clear();
    if (guide_) aim_looks(birth, size.looks, w);
}

}  // namespace rcs
