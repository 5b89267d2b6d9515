#include "lit_points/arrival_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "util/multiversion.h"
#include "util/turns.h"

namespace rcs {
namespace {

constexpr std::size_t kCount = ArrivalMap::kBins;
constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kSolidAngle = 4.0f * kPi / static_cast<float>(ArrivalMap::kBins);
// A bin leans on that of the coarser cell as if it had so many rays from there.
constexpr float kRaysOfCoarser = 2.0f;
// Of a square of light over the map's unit: the most that is told apart, and the steps of whole numbers to 1.
constexpr float kMostLight = 1e4f, kSteps = 1024.0f;

// Of the rows, that threads teach.
constexpr std::size_t kParts = 8;

struct Directions {
    std::array<float, kCount> x, y, z;
};

/// Bins go to and fro, so that neighbours in number are neighbours in direction.
RCS_ALWAYS_INLINE int turn_of(int ring, int place) { return ring % 2 == 0 ? place : ArrivalMap::kTurns - 1 - place; }

glm::vec3 direction_at(float ring, float turn)
{
    const float z = std::clamp(2.0f * ring / ArrivalMap::kRings - 1.0f, -1.0f, 1.0f);
    const float radius = std::sqrt(std::max(0.0f, 1.0f - z * z));
    const float turns = turn / ArrivalMap::kTurns;
    return {radius * sine_of_turns(turns + 0.25f), radius * sine_of_turns(turns), z};
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

/// @param means  of the coarser cell, become those of this one
RCS_MULTIVERSION
void refine(const float* squares, const float* rays, float* means)
{
    for (std::size_t i = 0; i < kCount; ++i)
        means[i] = (squares[i] + kRaysOfCoarser * means[i]) / (rays[i] + kRaysOfCoarser);
}

/// @param means  become the bins' chances
RCS_MULTIVERSION
void weigh_by_cosine(const float* x, const float* y, const float* z, glm::vec3 normal, float* means)
{
    // Of a bin that the horizon crosses, the middle may lie below it.
    constexpr float kBelow = -0.5f / ArrivalMap::kRings;
    for (std::size_t i = 0; i < kCount; ++i) {
        const float cosine = x[i] * normal.x + y[i] * normal.y + z[i] * normal.z;
        const float counted = cosine > -kBelow ? cosine : -kBelow;
        means[i] = cosine > kBelow ? std::sqrt(means[i]) * counted : 0.0f;
    }
}

RCS_MULTIVERSION
void find_bins(const Basis& axes, const float* x, const float* y, const float* z, std::size_t count,
               std::uint16_t* bins)
{
    constexpr int kRings = ArrivalMap::kRings, kTurns = ArrivalMap::kTurns;
    for (std::size_t i = 0; i < count; ++i) {
        const float dx = x[i] * axes.x.x + y[i] * axes.y.x + z[i] * axes.z.x;
        const float dy = x[i] * axes.x.y + y[i] * axes.y.y + z[i] * axes.z.y;
        const float dz = x[i] * axes.x.z + y[i] * axes.y.z + z[i] * axes.z.z;
        const int ring = std::clamp(static_cast<int>((dz + 1.0f) * (0.5f * kRings)), 0, kRings - 1);
        const int turn = std::min(static_cast<int>(turns_of(dx, dy) * kTurns), kTurns - 1);
        bins[i] = static_cast<std::uint16_t>(ring * kTurns + turn_of(ring, turn));
    }
}

}  // namespace

ArrivalMap::ArrivalMap(const CellGrid& grid, float unit) : grid_(grid), unit_(unit) { add_row(); }

void ArrivalMap::bins_of(const Basis& axes, const float* x, const float* y, const float* z,
                         std::span<std::uint16_t> bins)
{
    find_bins(axes, x, y, z, bins.size(), bins.data());
}

void ArrivalMap::add_row()
{
    exact_squares_.resize(exact_squares_.size() + kCount);
    squares_.resize(exact_squares_.size());
    rays_.resize(exact_squares_.size());
}

std::uint32_t ArrivalMap::row(std::uint64_t cell)
{
    const auto next = static_cast<std::uint32_t>(rays_.size() / kCount);
    const std::uint32_t number = table_.find_or_insert(cell, next);
    if (number == next) add_row();
    return number;
}

void ArrivalMap::weigh(const LookCells& cells, glm::vec3 normal, std::span<float> sums) const
{
    const auto refine_by = [&](std::size_t row) {
        refine(squares_.data() + row * kCount, rays_.data() + row * kCount, sums.data());
    };
    std::fill(sums.begin(), sums.end(), kSteps);
    refine_by(0);
    for (std::size_t level = cells.size(); level-- > 0;)
        if (const std::uint32_t row = table_.find(cells[level]); row != CellTable::kNone) refine_by(row);
    weigh_by_cosine(kMiddles.x.data(), kMiddles.y.data(), kMiddles.z.data(), normal, sums.data());
    std::partial_sum(sums.begin(), sums.end(), sums.begin());
}

ArrivalMap::Choice ArrivalMap::choose(std::span<const float> sums, float at, glm::vec2 u, std::size_t& bin)
{
    while (bin + 1 < kCount && sums[bin] <= at) ++bin;
    const int ring = static_cast<int>(bin) / kTurns, turn = turn_of(ring, static_cast<int>(bin) % kTurns);
    return {direction_at(static_cast<float>(ring) + u.x, static_cast<float>(turn) + u.y),
            static_cast<std::uint16_t>(bin)};
}

float ArrivalMap::density(std::span<const float> sums, std::size_t bin)
{
    return (sums[bin] - (bin > 0 ? sums[bin - 1] : 0.0f)) / (sums[kCount - 1] * kSolidAngle);
}

void ArrivalMap::count(std::size_t at, float light)
{
    const float relative = std::min(light / unit_, kMostLight);
    squares_[at] = static_cast<float>(exact_squares_[at] += static_cast<std::uint64_t>(kSteps * relative * relative));
    rays_[at] += 1.0f;
}

void ArrivalMap::learn(std::span<const Arrivals> gathers, std::span<const ArrivedRay> arrivals, ThreadPool& pool)
{
    using Rows =
        std::array<std::size_t, 3>;  // everywhere, the finer cell, the coarser one, which is a finer one elsewhere
    std::vector<Rows> rows;
    rows.reserve(gathers.size());
    for (const Arrivals& gather : gathers) rows.push_back({0, row(gather.cells[0]), row(gather.cells[1])});
    // A row belongs to one part alone.
    pool.parallel_for(kParts, 1, [&](std::size_t part, std::size_t, int) {
        for (std::size_t g = 0; g < gathers.size(); ++g)
            for (const std::size_t r : rows[g]) {
                if (r % kParts != part) continue;
                for (const ArrivedRay& ray : arrivals.subspan(gathers[g].first, gathers[g].count))
                    count(r * kCount + ray.bin, ray.light);
            }
    });
}

}  // namespace rcs
