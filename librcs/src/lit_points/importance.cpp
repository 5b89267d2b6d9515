#include "lit_points/importance.h"

#include <algorithm>

namespace rcs {
namespace {

// A cell and coarser ones around it, each four times as wide.
constexpr int kLevels = 3, kStep = 2;
// A mean of fewer samples is taken in with that of the coarser cell around, as if it had so many there.
constexpr double kPrior = 2.0;

std::uint64_t coarser(std::uint64_t cell)
{
    for (int i = 0; i < kStep && CellGrid::level_of(cell) + 1 < CellGrid::kLevels; ++i) cell = CellGrid::parent(cell);
    return cell;
}

}  // namespace

template <typename Add>
void Importance::note(glm::vec3 position, glm::vec3 normal, const Add& add)
{
    std::uint64_t key = leaf(position, normal);
    for (int level = 0; level < kLevels; ++level) {
        const std::uint32_t number = table_.find_or_insert(key, static_cast<std::uint32_t>(cells_.size()));
        if (number == cells_.size()) cells_.push_back({.key = key});
        add(cells_[number]);
        key = coarser(key);
    }
}

void Importance::note_seen(glm::vec3 position, glm::vec3 normal)
{
    note(position, normal, [](Cell& cell) { cell.seen += 1.0; });
}

void Importance::note_light(glm::vec3 position, glm::vec3 normal, float radiosity)
{
    note(position, normal, [&](Cell& cell) {
        cell.light += static_cast<double>(radiosity);
        cell.samples += 1.0;
    });
}

void Importance::update()
{
    // Coarse cells first: finer ones lean on those above them.
    values_.resize(cells_.size());
    std::vector<std::uint32_t> order(cells_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return CellGrid::level_of(cells_[a].key) > CellGrid::level_of(cells_[b].key);
    });
    for (const std::uint32_t i : order) {
        Cell& cell = cells_[i];
        const float edge = grid_.edge(static_cast<int>(CellGrid::level_of(cell.key)));
        const float own = static_cast<float>(cell.seen) / (edge * edge);
        const std::uint32_t above = table_.find(coarser(cell.key));
        const bool leans = above != CellTable::kNone && above != i;
        values_[i].seen = leans ? 0.5f * (own + values_[above].seen) : own;
        const double prior = leans ? static_cast<double>(cells_[above].brightness) : 0.0;
        const double counts = leans ? kPrior : 0.0;
        cell.brightness = static_cast<float>((cell.light + counts * prior) / std::max(cell.samples + counts, 1.0));
        values_[i].bright = values_[i].seen * cell.brightness;
    }
}

Importance::Value Importance::of(std::uint64_t leaf) const
{
    std::uint64_t key = leaf;
    for (int level = 0; level < kLevels; ++level) {
        const std::uint32_t number = table_.find(key);
        if (number != CellTable::kNone) return values_[number];
        key = coarser(key);
    }
    return {};
}

}  // namespace rcs
