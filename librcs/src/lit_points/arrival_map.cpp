#include "lit_points/arrival_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr std::size_t kCount = ArrivalMap::kBins;
constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kSolidAngle = 4.0f * kPi / static_cast<float>(ArrivalMap::kBins);
// A bin leans on that of the coarser cell as if it had so many rays from there.
constexpr float kRaysOfCoarser = 2.0f;
// Of a square of light over the map's unit: the most that is told apart, and the steps of whole numbers to 1.
constexpr float kMostLight = 1e4f, kSteps = 1024.0f;

struct Directions {
    std::array<float, kCount> x, y, z;
};

/// Bins go to and fro, so that neighbours in number are neighbours in direction.
int turn_of(int ring, int place) { return ring % 2 == 0 ? place : ArrivalMap::kTurns - 1 - place; }

glm::vec3 direction_at(float ring, float turn)
{
    const float z = std::clamp(2.0f * ring / ArrivalMap::kRings - 1.0f, -1.0f, 1.0f);
    const float radius = std::sqrt(std::max(0.0f, 1.0f - z * z));
    const float phi = 2.0f * kPi * turn / ArrivalMap::kTurns;
    return {radius * std::cos(phi), radius * std::sin(phi), z};
}

Directions middles()
{
    Directions d{};
    for (int ring = 0; ring < ArrivalMap::kRings; ++ring)
        for (int place = 0; place < ArrivalMap::kTurns; ++place) {
            const glm::vec3 v =
                direction_at(static_cast<float>(ring) + 0.5f, static_cast<float>(turn_of(ring, place)) + 0.5f);
            const std::size_t bin = static_cast<std::size_t>(ring * ArrivalMap::kTurns + place);
            d.x[bin] = v.x, d.y[bin] = v.y, d.z[bin] = v.z;
        }
    return d;
}
const Directions kMiddles = middles();

}  // namespace

ArrivalMap::ArrivalMap(const CellGrid& grid, float unit) : grid_(grid), unit_(unit), counts_(kCount) {}

std::uint16_t ArrivalMap::bin_of(glm::vec3 direction)
{
    const int ring = std::clamp(static_cast<int>((direction.z + 1.0f) * (0.5f * kRings)), 0, kRings - 1);
    const float turns = std::atan2(direction.y, direction.x) / (2.0f * kPi);
    const int turn = std::clamp(static_cast<int>((turns < 0.0f ? turns + 1.0f : turns) * kTurns), 0, kTurns - 1);
    return static_cast<std::uint16_t>(ring * kTurns + turn_of(ring, turn));
}

std::uint32_t ArrivalMap::row(std::uint64_t cell)
{
    const std::uint32_t number = table_.find_or_insert(cell, static_cast<std::uint32_t>(counts_.size() / kCount));
    counts_.resize(std::max(counts_.size(), (std::size_t{number} + 1) * kCount));
    return number;
}

void ArrivalMap::weigh(const LookCells& cells, glm::vec3 normal, std::span<float> sums) const
{
    const auto refine = [&](std::size_t number) {
        const Counts* const counts = counts_.data() + number * kCount;
        for (std::size_t i = 0; i < kCount; ++i)
            sums[i] = (static_cast<float>(counts[i].squares) + kRaysOfCoarser * sums[i]) /
                      (static_cast<float>(counts[i].rays) + kRaysOfCoarser);
    };
    std::fill(sums.begin(), sums.end(), kSteps);
    refine(0);
    for (std::size_t level = cells.size(); level-- > 0;)
        if (const std::uint32_t number = table_.find(cells[level]); number != CellTable::kNone) refine(number);
    // Of a bin that the horizon crosses, the middle may lie below it.
    const float least = -0.5f / kRings;
    float sum = 0.0f;
    for (std::size_t i = 0; i < kCount; ++i) {
        const float cosine = kMiddles.x[i] * normal.x + kMiddles.y[i] * normal.y + kMiddles.z[i] * normal.z;
        sums[i] = sum += cosine > least ? std::sqrt(sums[i]) * std::max(cosine, -least) : 0.0f;
    }
}

ArrivalMap::Choice ArrivalMap::choose(std::span<const float> sums, float at, glm::vec2 u, std::size_t& bin)
{
    while (bin + 1 < kCount && sums[bin] <= at) ++bin;
    const int ring = static_cast<int>(bin) / kTurns, turn = turn_of(ring, static_cast<int>(bin) % kTurns);
    const float chance = sums[bin] - (bin > 0 ? sums[bin - 1] : 0.0f);
    return {direction_at(static_cast<float>(ring) + u.x, static_cast<float>(turn) + u.y),
            chance / (sums[kCount - 1] * kSolidAngle)};
}

float ArrivalMap::density(std::span<const float> sums, glm::vec3 direction)
{
    const std::size_t bin = bin_of(direction);
    return (sums[bin] - (bin > 0 ? sums[bin - 1] : 0.0f)) / (sums[kCount - 1] * kSolidAngle);
}

void ArrivalMap::learn(std::span<const Arrivals> gathers, std::span<const ArrivedRay> arrivals)
{
    for (const Arrivals& gather : gathers) {
        const std::size_t rows[] = {0, row(gather.cells[0]), row(gather.cells[1])};
        for (const ArrivedRay& a : arrivals.subspan(gather.first, gather.count)) {
            const float light = std::min(a.light / unit_, kMostLight);
            const auto square = static_cast<std::uint64_t>(kSteps * light * light);
            for (const std::size_t r : rows) {
                Counts& counts = counts_[r * kCount + a.bin];
                ++counts.rays;
                counts.squares += square;
            }
        }
    }
}

}  // namespace rcs
