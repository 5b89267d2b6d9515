#pragma once

#include <array>
#include <cstddef>

#include <glm/glm.hpp>

namespace rcs {

/// Sums over blocks of consecutive Sobol' points, and how far their means scatter.
class BlockMeans {
public:
    static constexpr int kFewest = 16;  ///< enough to estimate their scatter to 18 %

    /// The largest power of two that leaves at least kFewest blocks of it, and fewer than twice as many.
    static int block_size(int samples)
    {
        int size = 1;
        while (samples / (2 * size) >= kFewest) size *= 2;
        return size;
    }

    void add(glm::dvec3 block_sum, int count) { blocks_[used_++] = {block_sum, static_cast<double>(count)}; }

    glm::dvec3 mean() const
    {
        glm::dvec3 sum(0.0);
        for (std::size_t i = 0; i < used_; ++i) sum += blocks_[i].sum;
        return sum / total();
    }

    /// As if blocks were independent. Blocks of one sequence complement each other, so this is an
    /// upper estimate. The last block may be smaller: blocks weigh by their size.
    glm::dvec3 standard_error() const
    {
        const glm::dvec3 m = mean();
        const double n = total();
        glm::dvec3 variance(0.0);
        for (std::size_t i = 0; i < used_; ++i) {
            const glm::dvec3 deviation = (blocks_[i].sum - m * blocks_[i].count) / n;
            variance += deviation * deviation;
        }
        const double used = static_cast<double>(used_);
        return glm::sqrt(variance * (used / (used - 1.0)));
    }

private:
    struct Block {
        glm::dvec3 sum{0.0};
        double count = 0.0;
    };
    double total() const
    {
        double count = 0.0;
        for (std::size_t i = 0; i < used_; ++i) count += blocks_[i].count;
        return count;
    }

    std::array<Block, 2 * kFewest> blocks_;
    std::size_t used_ = 0;
};

}  // namespace rcs
