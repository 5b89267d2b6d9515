#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "placement/spacing.h"
#include "records/gather.h"
#include "util/median_split.h"

namespace rcs {

/// A k-d tree over records that also knows the least trusted distance below each node, for
/// min over j of (R_j + |x_i - x_j|).
class ClampTree {
public:
    ClampTree() = default;
    struct Point {
        glm::vec3 position;
        float distance;
    };
    /// @param beyond  how far past a point what clamped() gives may reach, in times the point's distance: 0 or 1
    ClampTree(std::vector<Point> points, float beyond) : points_(std::move(points)), beyond_(beyond)
    {
        if (!points_.empty()) build(0, points_.size());
    }

    /// @param most  more than this is not wanted
    float clamped(glm::vec3 position, float most) const
    {
        if (!nodes_.empty() && may_lower(nodes_[0], distance2_to(nodes_[0], position), most)) search(0, position, most);
        return most;
    }

private:
    struct Node {
        glm::vec3 low, high;
        float least;
        std::uint32_t begin, end;  // of points_
        std::uint32_t right;       // the left child follows its parent; 0 marks a leaf
    };
    static constexpr std::size_t kLeaf = 8;

    std::uint32_t build(std::size_t begin, std::size_t end)
    {
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        const std::uint32_t id = static_cast<std::uint32_t>(nodes_.size());
        Node node{glm::vec3(kInfinity),
                  glm::vec3(-kInfinity),
                  kInfinity,
                  static_cast<std::uint32_t>(begin),
                  static_cast<std::uint32_t>(end),
                  0};
        for (std::size_t k = begin; k < end; ++k) {
            node.low = glm::min(node.low, points_[k].position);
            node.high = glm::max(node.high, points_[k].position);
            node.least = std::min(node.least, points_[k].distance);
        }
        nodes_.push_back(node);
        if (end - begin <= kLeaf) return id;
        const std::size_t middle = split_at_median(points_, begin, end, node.high - node.low,
                                                   [](const Point& p) -> const glm::vec3& { return p.position; });
        build(begin, middle);
        const std::uint32_t right = build(middle, end);
        nodes_[id].right = right;
        return id;
    }

    static float distance2_to(const Node& node, glm::vec3 p)
    {
        const glm::vec3 d = glm::max(glm::max(node.low - p, p - node.high), glm::vec3(0.0f));
        return glm::dot(d, d);
    }

    /// Whether a node, whose box lies so far away, may hold something that lowers `best`.
    bool may_lower(const Node& node, float distance2, float best) const
    {
        const float room = best - beyond_ * node.least;
        return node.least < best && room > 0.0f && distance2 < room * room;
    }

    void search(std::uint32_t id, glm::vec3 p, float& best) const
    {
        const Node& node = nodes_[id];
        if (node.right == 0) {
            for (std::uint32_t k = node.begin; k < node.end; ++k) {
                const float own = points_[k].distance, room = best - beyond_ * own;
                const glm::vec3 d = p - points_[k].position;
                if (own < best && room > 0.0f && glm::dot(d, d) < room * room)
                    best = std::max(own, beyond_ * own + glm::length(d));
            }
            return;
        }
        std::uint32_t near = id + 1, far = node.right;
        float to_near = distance2_to(nodes_[near], p), to_far = distance2_to(nodes_[far], p);
        if (to_far < to_near) std::swap(near, far), std::swap(to_near, to_far);
        if (may_lower(nodes_[near], to_near, best)) search(near, p, best);
        if (may_lower(nodes_[far], to_far, best)) search(far, p, best);
    }

    std::vector<Point> points_;
    std::vector<Node> nodes_;
    float beyond_ = 1.0f;
};

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

/// Bits of a coordinate, two zeros between each.
std::uint32_t spread_bits(float part)
{
    auto bits = static_cast<std::uint32_t>(part > 0.0f ? std::min(1023.0f, 1024.0f * part) : 0.0f);
    bits = (bits | bits << 16) & 0x030000ffu;
    bits = (bits | bits << 8) & 0x0300f00fu;
    bits = (bits | bits << 4) & 0x030c30c3u;
    return (bits | bits << 2) & 0x09249249u;
}

/// Adds the records from `first` on to the order, neighbours in space next to each other: along a Z curve (Morton
/// 1966).
void add_by_place(std::span<const Record> records, std::size_t first, std::vector<std::uint32_t>& order)
{
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const Record& r : records.subspan(first)) low = glm::min(low, r.position), high = glm::max(high, r.position);
    std::vector<std::uint64_t> codes;
    for (std::size_t i = first; i < records.size(); ++i) {
        const glm::vec3 part = (records[i].position - low) / (high - low);
        const std::uint32_t code = spread_bits(part.x) | spread_bits(part.y) << 1 | spread_bits(part.z) << 2;
        codes.push_back(std::uint64_t{code} << 32 | i);
    }
    std::sort(codes.begin(), codes.end());
    for (const std::uint64_t code : codes) order.push_back(static_cast<std::uint32_t>(code));
}

}  // namespace

// Quarters of many records are built side by side; every tree of few is one more to ask.
constexpr std::size_t kTreesAtOnce = 4;
constexpr std::size_t kManyRecords = 4096;
constexpr std::size_t kMostTrees = 20;
constexpr float kBarelyMore = 1.00001f;

struct SpacingLimiter::Trees {
    std::vector<ClampTree> list;      // every record so far is in one of them
    std::vector<ClampTree> steep;     // ... and here if light is steep there
    std::vector<std::size_t> newest;  // per tree: one past the last record in it

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
    float most;          // what neighbours may lower
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
        const float most = most_reach(records[i], options_);
        known_.push_back({records[i].position, most, most, least_reach(records[i], options_), 0});
    }
    pool.parallel_for(records.size() - first, 256, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = first + begin; k < first + end; ++k) {
            Known& own = known_[order_[k]];
            const float near = own.near, steep = own.steep;
            // It falls with the distance no faster than that grows, so the record before says how high it is at most;
            // a little more, for rounding, so that the search finds the value itself.
            if (k > first + begin) {
                const Known& before = known_[order_[k - 1]];
                if (before.near < before.most)
                    own.near =
                        std::min(own.near, kBarelyMore * (before.near + glm::distance(own.position, before.position)));
            }
            // The minimum over all neighbours is the least of those over the records of each tree.
            for (std::size_t t = 0; t < trees.list.size(); ++t) {
                if (trees.newest[t] <= own.seen) continue;
                own.near = trees.list[t].clamped(own.position, own.near);
                own.steep = trees.steep[t].clamped(own.position, own.steep);
            }
            const bool is_set = own.seen != 0 && own.near == near && own.steep == steep;
            own.seen = static_cast<std::uint32_t>(records.size());
            if (!is_set) set_spacing(records[order_[k]], own.near, own.steep, options_);
        }
    });
    if (first == 0 && trees.list.size() > kMostTrees) {
        // All are up to date: few trees answer faster than many, once there are many.
        trees = {};
        order_.clear();
        add_by_place(records, 0, order_);
        trees.add(records, 0, order_, options_, pool);
    }
}

void limit_spacing(std::vector<Record>& records, const RecordSettings& options, ThreadPool& pool)
{
    SpacingLimiter(options).limit(records, 0, pool);
}

}  // namespace rcs
