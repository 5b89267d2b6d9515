#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "rcs/records.h"
#include "util/color.h"

namespace rcs {
namespace {

/// A k-d tree over records that also knows the least trusted distance below each node, for
/// min over j of (R_j + |x_i - x_j|).
class ClampTree {
public:
    ClampTree(const std::vector<Record>& records, const std::vector<float>& distances)
        : records_(records), distances_(distances), order_(records.size())
    {
        std::iota(order_.begin(), order_.end(), 0u);
        if (!order_.empty())
            build(0, order_.size());
    }

    float clamped(std::size_t i) const
    {
        float best = distances_[i];
        search(0, records_[i].position, best);
        return best;
    }

private:
    struct Node {
        glm::vec3 low, high;
        float least;
        std::uint32_t begin, end;  // of order_
        std::uint32_t right;       // the left child follows its parent; 0 marks a leaf
    };
    static constexpr std::size_t kLeaf = 8;

    std::uint32_t build(std::size_t begin, std::size_t end)
    {
        const std::uint32_t id = static_cast<std::uint32_t>(nodes_.size());
        Node node{glm::vec3(std::numeric_limits<float>::infinity()), glm::vec3(-std::numeric_limits<float>::infinity()),
                  std::numeric_limits<float>::infinity(), static_cast<std::uint32_t>(begin),
                  static_cast<std::uint32_t>(end), 0};
        for (std::size_t k = begin; k < end; ++k) {
            node.low = glm::min(node.low, records_[order_[k]].position);
            node.high = glm::max(node.high, records_[order_[k]].position);
            node.least = std::min(node.least, distances_[order_[k]]);
        }
        nodes_.push_back(node);
        if (end - begin <= kLeaf)
            return id;
        const glm::vec3 size = node.high - node.low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const std::size_t middle = (begin + end) / 2;
        const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
        std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
            const float pa = records_[a].position[axis], pb = records_[b].position[axis];
            return pa < pb || (pa == pb && a < b);
        });
        build(begin, middle);
        const std::uint32_t right = build(middle, end);
        nodes_[id].right = right;
        return id;
    }

    static float distance_to(const Node& node, glm::vec3 p)
    {
        return glm::length(glm::max(glm::max(node.low - p, p - node.high), glm::vec3(0.0f)));
    }

    void search(std::uint32_t id, glm::vec3 p, float& best) const
    {
        const Node& node = nodes_[id];
        if (node.least + distance_to(node, p) >= best)
            return;
        if (node.right == 0) {
            for (std::uint32_t k = node.begin; k < node.end; ++k)
                best = std::min(best, distances_[order_[k]] + glm::distance(p, records_[order_[k]].position));
            return;
        }
        const bool right_first = distance_to(nodes_[node.right], p) < distance_to(nodes_[id + 1], p);
        search(right_first ? node.right : id + 1, p, best);
        search(right_first ? id + 1 : node.right, p, best);
    }

    const std::vector<Record>& records_;
    const std::vector<float>& distances_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

/// How far the record's first-order expansion stays sensible: where it would reach zero or twice its value.
float gradient_reach(const Record& r)
{
    const glm::vec3 gradient = 0.2126f * r.translation_gradient[0] + 0.7152f * r.translation_gradient[1] +
                               0.0722f * r.translation_gradient[2];
    const float steepness = glm::length(gradient);
    return steepness > 0.0f ? luminance(r.irradiance) / steepness : std::numeric_limits<float>::infinity();
}

}  // namespace

void limit_spacing(std::vector<Record>& records, const RecordOptions& options, ThreadPool& pool)
{
    std::vector<float> distance(records.size());
    for (std::size_t i = 0; i < records.size(); ++i)
        distance[i] = records[i].harmonic_mean_distance;
    const ClampTree tree(records, distance);
    pool.parallel_for(records.size(), 256, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i) {
            Record& r = records[i];
            const float steep = gradient_reach(r);
            const float reach = std::min(tree.clamped(i), options.gradient_limit * steep);
            r.spacing_radius = std::clamp(options.error_tolerance * reach, options.min_spacing * r.footprint,
                                          options.max_spacing * r.footprint);
            const float trusted = options.error_tolerance * std::min(reach, steep);
            r.gradient_scale = std::min(1.0f, trusted / r.spacing_radius);
        }
    });
}

}  // namespace rcs
