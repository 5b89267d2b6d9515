#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "placement/spacing.h"

namespace rcs {

/// A k-d tree over records that also knows the least trusted distance below each node, for
/// min over j of (R_j + |x_i - x_j|).
class ClampTree {
public:
    ClampTree() = default;
    explicit ClampTree(std::span<const Record> records)
    {
        for (const Record& r : records) points_.push_back({r.position, r.harmonic_mean_distance});
        if (!points_.empty()) build(0, points_.size());
    }

    /// @param most  more than this is not wanted
    float clamped(glm::vec3 position, float most) const
    {
        if (!nodes_.empty()) search(0, position, most);
        return most;
    }

private:
    struct Point {
        glm::vec3 position;
        float distance;
    };
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
        const glm::vec3 size = node.high - node.low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const std::size_t middle = (begin + end) / 2;
        const auto at = [&](std::size_t k) { return points_.begin() + static_cast<std::ptrdiff_t>(k); };
        std::nth_element(at(begin), at(middle), at(end),
                         [&](const Point& a, const Point& b) { return a.position[axis] < b.position[axis]; });
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

    /// Whether a node may hold something that lowers `best`.
    static bool may_lower(const Node& node, glm::vec3 p, float best)
    {
        const float room = best - node.least;
        return room > 0.0f && distance2_to(node, p) < room * room;
    }

    void search(std::uint32_t id, glm::vec3 p, float& best) const
    {
        const Node& node = nodes_[id];
        if (!may_lower(node, p, best)) return;
        if (node.right == 0) {
            for (std::uint32_t k = node.begin; k < node.end; ++k) {
                const float room = best - points_[k].distance;
                const glm::vec3 d = p - points_[k].position;
                if (room > 0.0f && glm::dot(d, d) < room * room) best = points_[k].distance + glm::length(d);
            }
            return;
        }
        const bool right_first = distance2_to(nodes_[node.right], p) < distance2_to(nodes_[id + 1], p);
        search(right_first ? node.right : id + 1, p, best);
        search(right_first ? id + 1 : node.right, p, best);
    }

    std::vector<Point> points_;
    std::vector<Node> nodes_;
};

namespace {

/// All limits but the neighbours', which `near` already holds.
void set_spacing(Record& r, float near, const RecordSettings& options)
{
    const float reach = std::clamp(std::min(near, options.gradient_limit * r.gradient_reach),
                                   r.closeness * options.min_reach * r.footprint, options.max_reach * r.footprint);
    r.spacing_radius = options.error_tolerance * reach;
    r.gradient_scale = std::min(1.0f, std::min(near, r.gradient_reach) / reach);
}

}  // namespace

// Records come in the order of pixels, so a quarter of them lies together; quarters are built side by side.
constexpr std::size_t kTreesAtOnce = 4;
constexpr std::size_t kMostTrees = 5 * kTreesAtOnce;

struct SpacingLimiter::Trees {
    std::vector<ClampTree> list;      // every record so far is in one of them
    std::vector<std::size_t> newest;  // per tree: one past the last record in it

    void add(std::span<const Record> records, std::size_t first, ThreadPool& pool)
    {
        const std::size_t known = list.size();
        const std::size_t count = records.size() - first;
        list.resize(known + kTreesAtOnce);
        newest.resize(list.size(), records.size());
        pool.parallel_for(kTreesAtOnce, 1, [&](std::size_t t, std::size_t, int) {
            const std::size_t begin = first + count * t / kTreesAtOnce;
            const std::size_t end = first + count * (t + 1) / kTreesAtOnce;
            list[known + t] = ClampTree(records.subspan(begin, end - begin));
        });
    }
};

SpacingLimiter::SpacingLimiter(const RecordSettings& options) : options_(options), trees_(std::make_unique<Trees>()) {}
SpacingLimiter::~SpacingLimiter() = default;

void SpacingLimiter::limit(std::vector<Record>& records, std::size_t first, ThreadPool& pool)
{
    Trees& trees = *trees_;
    if (records.size() > near_.size()) trees.add(records, near_.size(), pool);
    for (std::size_t i = near_.size(); i < records.size(); ++i)
        near_.push_back(std::min(records[i].harmonic_mean_distance, options_.max_reach * records[i].footprint));
    seen_.resize(records.size(), 0);
    pool.parallel_for(records.size() - first, 256, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = first + begin; i < first + end; ++i) {
            // The minimum over all neighbours is the least of those over the records of each tree.
            for (std::size_t t = 0; t < trees.list.size(); ++t)
                if (trees.newest[t] > seen_[i]) near_[i] = trees.list[t].clamped(records[i].position, near_[i]);
            seen_[i] = static_cast<std::uint32_t>(records.size());
            set_spacing(records[i], near_[i], options_);
        }
    });
    if (first == 0 && trees.list.size() > kMostTrees) {
        // All are up to date: few trees answer faster than many, once there are many.
        trees = {};
        trees.add(records, 0, pool);
    }
}

void limit_spacing(std::vector<Record>& records, const RecordSettings& options, ThreadPool& pool)
{
    SpacingLimiter(options).limit(records, 0, pool);
}

}  // namespace rcs
