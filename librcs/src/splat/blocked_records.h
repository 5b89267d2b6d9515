#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "rcs/thread_pool.h"
#include "shared/weight.h"

namespace rcs {

/// What a record is in sums over the records around each.
struct Voice {
    glm::vec3 position, normal;
    float radius;          ///< that it influences [m], > 0
    std::uint32_t number;  ///< of the caller's
};

/// Records that lie near each other, side by side.
struct RecordBlock {
    static constexpr std::size_t kLanes = 16;
    using Lanes = float[kLanes];

    Lanes position[3], normal[3], inverse_radius;
    Lanes is_there;       // 1, or 0 from `count` on
    glm::vec3 low, high;  // around the spheres that its records influence
    std::array<std::uint32_t, kLanes> number;
    std::size_t count;
};

inline gpu::vec3 lane_of(const RecordBlock::Lanes (&v)[3], std::size_t lane)
{
    return {v[0][lane], v[1][lane], v[2][lane]};
}

/// A record that others are weighed at.
struct WeighedAt {
    gpu::vec3 position, normal;
    float inverse_normal_tolerance;
};

/// What the block's records weigh there, in a splat: 1 for a record itself, 0 beyond what it influences.
/// @return whether any of them weighs something
bool weigh(const RecordBlock& block, const WeighedAt& here, float* weight);

/// Records in blocks, and the boxes around the spheres that they influence: what is around each of many is found
/// without a look at all.
class BlockedRecords {
public:
    explicit BlockedRecords(std::vector<Voice> voices);

    const std::vector<RecordBlock>& list() const { return blocks_; }

    /// Numbers of those that may influence one of this block's records, always in the same order.
    void find_around(const RecordBlock& block, std::vector<std::uint32_t>& found) const;

    /// Shows `add` what influences a record: the number of a block, and what its records weigh, 0 from its count on.
    /// @param near  find_around() for the record's block
    template <typename Add>
    void for_each_around(std::span<const std::uint32_t> near, const WeighedAt& here, const Add& add) const
    {
        const glm::vec3 p(here.position.x, here.position.y, here.position.z);
        for (const std::uint32_t b : near) {
            const RecordBlock& block = blocks_[b];
            if (glm::any(glm::lessThan(p, block.low)) || glm::any(glm::greaterThan(p, block.high))) continue;
            RecordBlock::Lanes weight;
            if (weigh(block, here, weight)) add(b, weight);
        }
    }

    /// Calls visit(block, lane, near, here) for all records, from all threads.
    /// @param normal_tolerance  of a splat: a times its overlap
    template <typename Visit>
    void for_each(float normal_tolerance, ThreadPool& pool, const Visit& visit) const
    {
        pool.parallel_for(blocks_.size(), 16, [&](std::size_t begin, std::size_t end, int) {
            std::vector<std::uint32_t> near;
            for (std::size_t b = begin; b < end; ++b) {
                const RecordBlock& block = blocks_[b];
                find_around(block, near);
                for (std::size_t l = 0; l < block.count; ++l)
                    visit(b, l, std::span<const std::uint32_t>(near),
                          WeighedAt{lane_of(block.position, l), lane_of(block.normal, l), 1.0f / normal_tolerance});
            }
        });
    }

private:
    struct Node {
        glm::vec3 low, high;
        std::uint32_t block;
        std::uint32_t right;  // the left child follows its parent; 0 marks a leaf
    };
    std::uint32_t build(std::vector<Voice>& voices, std::size_t begin, std::size_t end);

    std::vector<Node> nodes_;
    std::vector<RecordBlock> blocks_;
};

}  // namespace rcs
