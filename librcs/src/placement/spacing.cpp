#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "placement/clamp_tree.h"
#include "placement/spacing.h"
#include "records/known_record.h"

namespace rcs {

namespace {

// Light is steep where it doubles within a quarter of the least reach: four times the way on which it does is the
// least there (measured: docs/method.md, Spacing).
constexpr float kSteep = 4.0f;

float least_reach(const Record& r, const RecordSettings& options)
{
    return r.closeness * options.min_reach * r.footprint;
}

/// The same where light is steepest.
float lowest_reach(const Record& r, const RecordSettings& options)
{
    return std::min(r.closeness, options.steepest) * options.min_reach * r.footprint;
}

/// What a record where light is steep reaches at the most; the least reach of any other.
float steep_reach(const Record& r, const RecordSettings& options)
{
    return std::clamp(kSteep * r.gradient_reach, lowest_reach(r, options), least_reach(r, options));
}

/// What neighbours may lower: more than this changes nothing of what set_spacing() sets.
float most_reach(const Record& r, const RecordSettings& options)
{
    return std::min({r.harmonic_mean_distance, options.max_reach * r.footprint,
                     std::max(1.0f, options.gradient_limit) * r.gradient_reach});
}

void trust_gradient(Record& r, const RecordSettings& options)
{
    const float sensible = std::min(r.gradient_reach, gradient_reach(r));
    r.gradient_scale = std::min(r.gradient_scale, sensible * options.error_tolerance / r.spacing_radius);
}

/// All limits but the neighbours', which `near` and `steep` already hold.
void set_spacing(Record& r, float near, float steep, const RecordSettings& options)
{
    const float least = std::max(steep, lowest_reach(r, options));
    if (steep < least_reach(r, options)) near = std::min(near, steep);
    const float reach =
        std::clamp(std::min(near, options.gradient_limit * r.gradient_reach), least, options.max_reach * r.footprint);
    r.spacing_radius = options.error_tolerance * reach;
    r.gradient_scale = std::min(1.0f, near / reach);
    trust_gradient(r, options);
}

/// Bits of a coordinate, two zeros between each: 20 of them, so that one record that lies far away does not put all
/// others in one place.
std::uint64_t spread_bits(float part)
{
    auto bits = static_cast<std::uint64_t>(part > 0.0f ? std::min(1048575.0f, 1048576.0f * part) : 0.0f);
    bits = (bits | bits << 32) & 0x001f00000000ffffu;
    bits = (bits | bits << 16) & 0x001f0000ff0000ffu;
    bits = (bits | bits << 8) & 0x100f00f00f00f00fu;
    bits = (bits | bits << 4) & 0x10c30c30c30c30c3u;
    return (bits | bits << 2) & 0x1249249249249249u;
}

/// Adds the records from `first` on to the order, neighbours in space next to each other: along a Z curve (Morton
/// 1966).
void add_by_place(std::span<const Record> records, std::size_t first, std::vector<std::uint32_t>& order)
{
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const Record& r : records.subspan(first)) low = glm::min(low, r.position), high = glm::max(high, r.position);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> codes;
    for (std::size_t i = first; i < records.size(); ++i) {
        const glm::vec3 part = (records[i].position - low) / (high - low);
        const std::uint64_t code = spread_bits(part.x) | spread_bits(part.y) << 1 | spread_bits(part.z) << 2;
        codes.emplace_back(code, static_cast<std::uint32_t>(i));
    }
    std::sort(codes.begin(), codes.end());
    for (const auto& [code, i] : codes) order.push_back(i);
}

}  // namespace

// Quarters of many records are built side by side; every tree of few is one more to ask.
constexpr std::size_t kTreesAtOnce = 4;
constexpr std::size_t kManyRecords = 4096;
constexpr std::size_t kMostTrees = 20;

struct SpacingLimiter::Trees {
    std::vector<ClampTree> list;      // every record so far is in one of them
    std::vector<ClampTree> steep;     // ... and here if light is steep there
    std::vector<std::size_t> newest;  // per tree: one past the last record in it

    /// Lowers what is allowed by the records of those trees that hold any from `seen` on.
    void lower(std::uint32_t seen, ClampedPlaces& near, ClampedPlaces& steep_ones) const
    {
        for (std::size_t t = 0; t < list.size(); ++t) {
            if (newest[t] <= seen) continue;
            list[t].lower(near);
            steep[t].lower(steep_ones);
        }
    }
    /// @param order  of all records: those from `first` on are next to each other in it, as they are in space
    void add(std::span<const Record> records, std::size_t first, std::span<const std::uint32_t> order,
             const RecordSettings& options, ThreadPool& pool)
    {
        const std::size_t known = list.size();
        const std::size_t count = records.size() - first;
        const std::size_t more = count < kManyRecords ? 1 : kTreesAtOnce;
        list.resize(known + more);
        steep.resize(list.size());
        newest.resize(list.size(), records.size());
        pool.parallel_for(more, 1, [&](std::size_t t, std::size_t, int) {
            const std::size_t begin = first + count * t / more, end = first + count * (t + 1) / more;
            std::vector<ClampTree::Point> all, steep_ones;
            for (const std::uint32_t i : order.subspan(begin, end - begin)) {
                const Record& r = records[i];
                const float reach = steep_reach(r, options);
                const bool is_steep = reach < least_reach(r, options);
                all.push_back(
                    {r.position, is_steep ? std::min(reach, r.harmonic_mean_distance) : r.harmonic_mean_distance});
                if (is_steep) steep_ones.push_back({r.position, reach});
            }
            list[known + t] = ClampTree(std::move(all), 1.0f);
            steep[known + t] = ClampTree(std::move(steep_ones), 0.0f);
        });
    }
};

/// What is asked of each record in every call, without the rest of it.
struct SpacingLimiter::Known {
    glm::vec3 position;
    float near;          // the least R_j + |x_i - x_j| over all j, or what is wanted at most
    float steep;         // the least reach, as far as light that is steep around lowers it
    std::uint32_t seen;  // over how many records j, from the first on
};

void trust_gradients(std::span<Record> records, const RecordSettings& options)
{
    for (Record& r : records) trust_gradient(r, options);
}

SpacingLimiter::SpacingLimiter(const RecordSettings& options) : options_(options), trees_(std::make_unique<Trees>()) {}
SpacingLimiter::~SpacingLimiter() = default;

void SpacingLimiter::limit(std::vector<Record>& records, std::size_t first, ThreadPool& pool)
{
    Trees& trees = *trees_;
    if (records.size() > known_.size()) {
        add_by_place(records, known_.size(), order_);
        trees.add(records, known_.size(), order_, options_, pool);
    }
    for (std::size_t i = known_.size(); i < records.size(); ++i) {
        const Record& r = records[i];
        known_.push_back({r.position, most_reach(r, options_), least_reach(r, options_), 0});
    }
    constexpr std::size_t kLanes = ClampedPlaces::kLanes;
    pool.parallel_for((records.size() - first + kLanes - 1) / kLanes, 16, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t b = begin; b < end; ++b)
            limit_some(records, std::span(order_)
                                    .subspan(first + b * kLanes)
                                    .first(std::min(kLanes, records.size() - first - b * kLanes)));
    });
    if (first == 0 && trees.list.size() > kMostTrees) {
        // All are up to date: few trees answer faster than many, once there are many.
        trees = {};
        order_.clear();
        add_by_place(records, 0, order_);
        trees.add(records, 0, order_, options_, pool);
    }
}

void SpacingLimiter::limit_some(std::vector<Record>& records, std::span<const std::uint32_t> which)
{
    ClampedPlaces near, steep;
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    std::uint32_t seen = std::numeric_limits<std::uint32_t>::max();
    for (std::size_t l = 0; l < ClampedPlaces::kLanes; ++l) {
        const Known& own = known_[which[std::min(l, which.size() - 1)]];
        for (int axis = 0; axis < 3; ++axis) near.position[axis][l] = own.position[axis];
        near.least[l] = own.near;
        steep.least[l] = own.steep;
        low = glm::min(low, own.position), high = glm::max(high, own.position);
        seen = std::min(seen, own.seen);
    }
    near.low = steep.low = low, near.high = steep.high = high;
    for (int axis = 0; axis < 3; ++axis) std::copy_n(near.position[axis], ClampedPlaces::kLanes, steep.position[axis]);
    trees_->lower(seen, near, steep);
    for (std::size_t l = 0; l < which.size(); ++l) {
        Known& own = known_[which[l]];
        const bool is_set = own.seen != 0 && own.near == near.least[l] && own.steep == steep.least[l];
        own.near = near.least[l];
        own.steep = steep.least[l];
        own.seen = static_cast<std::uint32_t>(records.size());
        if (!is_set) set_spacing(records[which[l]], own.near, own.steep, options_);
    }
}

void limit_spacing(std::vector<Record>& records, const RecordSettings& options, ThreadPool& pool)
{
    SpacingLimiter(options).limit(records, 0, pool);
}

}  // namespace rcs
