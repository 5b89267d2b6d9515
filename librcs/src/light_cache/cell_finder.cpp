#include "light_cache/cell_finder.h"

#include <algorithm>
#include <utility>

#include "util/random.h"

namespace rcs {
namespace {

// Visible points of the look around: one in each cell of a grid of so many rows and columns.
constexpr int kLooks = 64;

std::vector<SurfaceSample> points_in_view(const GBuffer& g, std::uint64_t seed)
{
    std::vector<SurfaceSample> points;
    const int columns = std::min(kLooks, g.width), rows = std::min(kLooks, g.height);
    for (int cy = 0; cy < rows; ++cy) {
        for (int cx = 0; cx < columns; ++cx) {
            RandomStream random(stream_key(seed, Stream::light_cache, static_cast<std::uint64_t>(cy * kLooks + cx)));
            const auto within = [&](int cell, int cells, int pixels) {
                const float at = (static_cast<float>(cell) + random.next()) / static_cast<float>(cells);
                return std::min(static_cast<int>(at * static_cast<float>(pixels)), pixels - 1);
            };
            const int x = within(cx, columns, g.width), y = within(cy, rows, g.height);
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(x);
            if (g.covered(i))
                points.push_back({g.scene_position(i), g.position_error[i], g.geometric_normal[i], g.normal(i)});
        }
    }
    return points;
}

}  // namespace

void CellFinder::note(std::span<const CellHit> hits, std::uint64_t key, std::vector<CellFind>& finds) const
{
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const CellHit& hit = hits[i];
        if (!hit.hit) continue;
        std::uint64_t cell = leaf_at(grid_, hit.surface.position, hit.surface.normal);
        bool known = known_.find(cell) != CellTable::kNone;
        for (int up = 0; up < coarser_ && !known && CellGrid::level_of(cell) + 1 < CellGrid::kLevels; ++up) {
            cell = CellGrid::parent(cell);
            known = known_.find(cell) != CellTable::kNone;
        }
        if (!known) finds.push_back({cell, mix64(key - 1 - i), hit.surface});
    }
}

/// All of them coarser where they would be too many cells.
void CellFinder::limit(std::vector<CellFind>& finds)
{
    std::vector<std::uint64_t> cells;
    for (;;) {
        cells.clear();
        for (const CellFind& find : finds) cells.push_back(find.cell);
        std::sort(cells.begin(), cells.end());
        const auto end = std::unique(cells.begin(), cells.end());
        if (end - cells.begin() <= most_) return;
        bool coarser = false;
        for (CellFind& find : finds) {
            if (CellGrid::level_of(find.cell) + 1 == CellGrid::kLevels) continue;
            find.cell = CellGrid::parent(find.cell);
            coarser = true;
        }
        if (!coarser) return;
        ++coarser_;
    }
}

void CellFinder::add(std::vector<CellFind> finds)
{
    limit(finds);
    std::vector<std::uint32_t> order(finds.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(finds[a].cell, finds[a].rank) < std::pair(finds[b].cell, finds[b].rank);
    });
    known_.reserve((keys_.size() + order.size()) * 2);
    for (std::size_t i = 0; i < order.size();) {
        const std::uint64_t cell = finds[order[i]].cell;
        std::size_t count = 0;
        for (; i < order.size() && finds[order[i]].cell == cell; ++i, ++count)
            if (count < places_of_cell_) places_.push_back(finds[order[i]].surface);
        add_cell(cell, count);
    }
}

/// Its places are there already. @param count  of finds
void CellFinder::add_cell(std::uint64_t cell, std::size_t count)
{
    first_.push_back(places_.size());
    counts_.push_back(static_cast<std::uint32_t>(count));
    keys_.push_back(cell);
    for (;; cell = CellGrid::parent(cell)) {
        if (known_.find(cell) == CellTable::kNone) known_.insert(cell, 0);
        if (CellGrid::level_of(cell) + 1 == CellGrid::kLevels) return;
    }
}

void look_around(const GBuffer& gbuffer, std::uint64_t seed, ThreadPool& pool, std::span<CellRays> counted,
                 CellFinder& finder)
{
    const std::vector<SurfaceSample> points = points_in_view(gbuffer, seed);
    std::vector<std::vector<CellFind>> found(counted.size());
    pool.parallel_for(points.size(), 16, [&](std::size_t begin, std::size_t end, int thread) {
        const auto t = static_cast<std::size_t>(thread);
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint64_t key = stream_key(seed + 1, Stream::light_cache, i);
            counted[t].trace({points[i], points[i], points[i], points[i]}, key, false);
            finder.note(counted[t].hits(), key, found[t]);
        }
    });
    std::vector<CellFind> finds;
    for (const std::vector<CellFind>& part : found) finds.insert(finds.end(), part.begin(), part.end());
    finder.add(std::move(finds));
}

}  // namespace rcs
