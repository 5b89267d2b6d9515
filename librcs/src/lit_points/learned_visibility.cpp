#include "lit_points/learned_visibility.h"

#include <algorithm>

#include "util/multiversion.h"

namespace rcs {
namespace {

// Cells of the grid so many levels up: a view is about 20 high of the finer ones.
constexpr int kUp[] = {1, 3};
// A chance is taken for one of the coarser cell until there are a few looks.
constexpr float kLooksOfCoarser = 1.5f;

}  // namespace

LearnedVisibility::LearnedVisibility(const CellGrid& grid, std::size_t clusters)
    : grid_(grid), clusters_(clusters), counts_(clusters)
{
}

LookCells look_cells(const CellGrid& grid, glm::vec3 position, glm::vec3 normal)
{
    LookCells result;
    std::uint64_t cell = leaf_at(grid, position, normal);
    int up = 0;
    for (std::size_t level = 0; level < result.size(); ++level) {
        for (; up < kUp[level] && CellGrid::level_of(cell) + 1 < CellGrid::kLevels; ++up) cell = CellGrid::parent(cell);
        result[level] = cell;
    }
    return result;
}

std::uint32_t LearnedVisibility::row(std::uint64_t cell)
{
    const std::uint32_t number = table_.find_or_insert(cell, static_cast<std::uint32_t>(counts_.size() / clusters_));
    counts_.resize(std::max(counts_.size(), (std::size_t{number} + 1) * clusters_));
    return number;
}

namespace {

template <typename Counts>
RCS_ALWAYS_INLINE float refined(const Counts& c, float coarser)
{
    return (static_cast<float>(c.free) + kLooksOfCoarser * coarser) / (static_cast<float>(c.looks) + kLooksOfCoarser);
}

}  // namespace

float LearnedVisibility::chance(std::size_t cluster) const { return refined(counts_[cluster], 1.0f); }

/// @param chances  of a coarser cell; become those of the cell that the counts are of
RCS_MULTIVERSION
void LearnedVisibility::refine(const Counts* counts, std::size_t clusters, float* chances)
{
    for (std::size_t i = 0; i < clusters; ++i) chances[i] = refined(counts[i], chances[i]);
}

void LearnedVisibility::estimate(const LookCells& cells, float least, float* chances) const
{
    std::fill_n(chances, clusters_, 1.0f);
    refine(counts_.data(), clusters_, chances);
    for (std::size_t level = cells.size(); level-- > 0;) {
        const std::uint32_t number = table_.find(cells[level]);
        if (number == CellTable::kNone) continue;
        refine(counts_.data() + number * clusters_, clusters_, chances);
    }
    for (std::size_t i = 0; i < clusters_; ++i) chances[i] = std::max(chances[i], least);
}

void LearnedVisibility::learn(std::span<const Look> looks)
{
    const Look* before = nullptr;
    std::array<std::uint32_t, 2> rows{};
    for (const Look& look : looks) {
        // A record's looks come one after the other.
        for (std::size_t level = 0; level < rows.size(); ++level)
            if (!before || before->cells[level] != look.cells[level]) rows[level] = row(look.cells[level]);
        before = &look;
        for (const std::size_t r : {std::size_t{0}, std::size_t{rows[0]}, std::size_t{rows[1]}}) {
            Counts& counts = counts_[r * clusters_ + look.cluster];
            ++counts.looks;
            counts.free += look.free ? 1u : 0u;
        }
    }
}

void LearnedVisibility::fade()
{
    constexpr std::uint32_t kMany = 64;
    for (Counts& counts : counts_)
        if (counts.looks > kMany) counts = {counts.looks / 2, counts.free / 2};
}

}  // namespace rcs
