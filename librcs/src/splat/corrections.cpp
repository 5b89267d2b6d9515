#include "splat/corrections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include <glm/glm.hpp>

#include "shared/weight.h"
#include "splat/gpu_records.h"
#include "util/color.h"
#include "util/median_split.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

// Smoothed residuals hold so much of the noise of those that they are made of.
constexpr double kNoiseLeft = 0.25;

constexpr std::size_t kLanes = 16;
using Lanes = float[kLanes];

/// A record, and how far it reaches.
struct Voice {
    const Record* record;
    float radius;
    std::uint32_t number;
};

/// Records that lie near each other, as a splat reads them, side by side; and what a splat is off by at them.
struct Block {
    Lanes position[3], normal[3], inverse_radius;
    Lanes irradiance[3], translation[3][3], rotation[3][3];  // by colour
    std::array<std::uint32_t, kLanes> number;
    std::size_t count;
    std::array<glm::dvec3, kLanes> residual;  // what the record holds and the splat does not say
    std::array<double, kLanes> variance;      // of the record's luminance, by its own word
    std::array<double, kLanes> noise;         // that of the residual's
};

void put(Block& block, std::size_t lane, const Voice& voice)
{
    const Record& r = *voice.record;
    for (int i = 0; i < 3; ++i) {
        block.position[i][lane] = r.position[i];
        block.normal[i][lane] = r.normal[i];
        block.irradiance[i][lane] = r.irradiance[i];
        for (std::size_t c = 0; c < 3; ++c) {
            block.translation[c][i][lane] = r.gradient_scale * r.translation_gradient[c][i];
            block.rotation[c][i][lane] = r.rotation_gradient[c][i];
        }
    }
    block.inverse_radius[lane] = 1.0f / voice.radius;
    block.number[lane] = voice.number;
    const double deviation = static_cast<double>(r.noise) * static_cast<double>(luminance(r.irradiance));
    block.variance[lane] = deviation * deviation;
}

/// Records in blocks, and the boxes around the spheres that they influence.
class BlockTree {
public:
    explicit BlockTree(std::vector<Voice> voices) : voices_(std::move(voices))
    {
        if (!voices_.empty()) build(0, voices_.size());
    }

    std::vector<Block>& blocks() { return blocks_; }

    /// Those that may influence one of this block's records, always in the same order.
    void find_around(const Block& block, std::vector<std::uint32_t>& found) const
    {
        glm::vec3 low(0.0f), high(0.0f);
        for (int i = 0; i < 3; ++i) {
            const auto ends = std::minmax_element(block.position[i], block.position[i] + block.count);
            low[i] = *ends.first;
            high[i] = *ends.second;
        }
        found.clear();
        std::array<std::uint32_t, 64> stack;  // halves: 2^32 records are 32 deep
        std::size_t waiting = 0;
        stack[waiting++] = 0;
        while (waiting > 0) {
            const std::uint32_t id = stack[--waiting];
            const Node& node = nodes_[id];
            if (glm::any(glm::lessThan(high, node.low)) || glm::any(glm::greaterThan(low, node.high))) continue;
            if (node.right == 0) {
                found.push_back(node.block);
            } else {
                stack[waiting++] = node.right;
                stack[waiting++] = id + 1;
            }
        }
    }

private:
    struct Node {
        glm::vec3 low, high;
        std::uint32_t block;
        std::uint32_t right;  // the left child follows its parent; 0 marks a leaf
    };

    std::uint32_t build(std::size_t begin, std::size_t end)
    {
        constexpr float kNowhere = std::numeric_limits<float>::infinity();
        const auto id = static_cast<std::uint32_t>(nodes_.size());
        Node node{glm::vec3(kNowhere), glm::vec3(-kNowhere), static_cast<std::uint32_t>(blocks_.size()), 0};
        for (std::size_t k = begin; k < end; ++k) {
            node.low = glm::min(node.low, voices_[k].record->position - voices_[k].radius);
            node.high = glm::max(node.high, voices_[k].record->position + voices_[k].radius);
        }
        nodes_.push_back(node);
        if (end - begin <= kLanes) {
            Block& block = blocks_.emplace_back();
            block.count = end - begin;
            for (std::size_t k = begin; k < end; ++k) put(block, k - begin, voices_[k]);
            return id;
        }
        const std::size_t middle =
            split_at_median(voices_, begin, end, node.high - node.low,
                            [](const Voice& v) -> const glm::vec3& { return v.record->position; });
        build(begin, middle);
        const std::uint32_t right = build(middle, end);
        nodes_[id].right = right;
        return id;
    }

    std::vector<Voice> voices_;
    std::vector<Node> nodes_;
    std::vector<Block> blocks_;
};

gpu::vec3 at(const Lanes (&v)[3], std::size_t lane) { return {v[0][lane], v[1][lane], v[2][lane]}; }

/// A record that others are weighed at.
struct Place {
    gpu::vec3 position, normal;
    float inverse_normal_tolerance;
};

/// What the block's records weigh there.
RCS_MULTIVERSION
void weigh(const Block& block, const Place& here, float* weight)
{
    RCS_WHOLE_LOOP
    for (std::size_t l = 0; l < kLanes; ++l) {
        const gpu::vec3 d{here.position.x - block.position[0][l], here.position.y - block.position[1][l],
                          here.position.z - block.position[2][l]};
        weight[l] = gpu::rcs_interpolation_weight(d, here.normal, at(block.normal, l), block.inverse_radius[l],
                                                  here.inverse_normal_tolerance);
    }
}

/// What they say of the light there, times their weight.
RCS_MULTIVERSION
void extrapolate(const Block& block, const Place& here, const float* weight, Lanes* light)
{
    for (std::size_t c = 0; c < 3; ++c) {
        RCS_WHOLE_LOOP
        for (std::size_t l = 0; l < kLanes; ++l) {
            const gpu::vec3 n = at(block.normal, l);
            const gpu::vec3 d{here.position.x - block.position[0][l], here.position.y - block.position[1][l],
                              here.position.z - block.position[2][l]};
            const gpu::vec3 turn{n.y * here.normal.z - n.z * here.normal.y, n.z * here.normal.x - n.x * here.normal.z,
                                 n.x * here.normal.y - n.y * here.normal.x};
            light[c][l] = weight[l] * gpu::rcs_extrapolate(block.irradiance[c][l], d, turn, at(block.translation[c], l),
                                                           at(block.rotation[c], l));
        }
    }
}

/// Shows `add` what influences a record: blocks, and what their records weigh.
template <typename Add>
void for_each_around(const std::vector<Block>& blocks, std::span<const std::uint32_t> near, const Place& here,
                     const Add& add)
{
    for (const std::uint32_t b : near) {
        Lanes weight;
        weigh(blocks[b], here, weight);
        const auto end = weight + blocks[b].count;
        if (std::any_of(weight, end, [](float w) { return w > 0.0f; })) add(blocks[b], weight);
    }
}

void set_residual(const std::vector<Block>& blocks, std::span<const std::uint32_t> near, const Place& here,
                  Block& block, std::size_t lane)
{
    glm::dvec3 light(0.0);
    double weights = 0.0, variance = 0.0;
    for_each_around(blocks, near, here, [&](const Block& other, const Lanes& weight) {
        Lanes said[3];
        extrapolate(other, here, weight, said);
        for (std::size_t l = 0; l < other.count; ++l) {
            if (!(weight[l] > 0.0f)) continue;
            const auto w = static_cast<double>(weight[l]);
            light += glm::dvec3(said[0][l], said[1][l], said[2][l]);
            weights += w;
            variance += w * w * other.variance[l];
        }
    });
    // The record itself has weight 1 among them.
    const double own = block.variance[lane] * (1.0 - 2.0 / weights);
    for (int c = 0; c < 3; ++c)
        block.residual[lane][c] = static_cast<double>(block.irradiance[c][lane]) - light[c] / weights;
    block.noise[lane] = std::max(0.0, own + variance / (weights * weights));
}

/// The residuals around, smoothed, as far as they are more than noise.
glm::vec3 correction(const std::vector<Block>& blocks, std::span<const std::uint32_t> near, const Place& here)
{
    glm::dvec3 light(0.0);
    double weights = 0.0, squares = 0.0, noise = 0.0;
    for_each_around(blocks, near, here, [&](const Block& other, const Lanes& weight) {
        for (std::size_t l = 0; l < other.count; ++l) {
            if (!(weight[l] > 0.0f)) continue;
            const auto w = static_cast<double>(weight[l]);
            const glm::dvec3& r = other.residual[l];
            const double y = 0.2126 * r.r + 0.7152 * r.g + 0.0722 * r.b;
            light += w * r;
            weights += w;
            squares += w * y * y;
            noise += w * other.noise[l];
        }
    });
    if (!(squares > 0.0 && std::isfinite(squares))) return glm::vec3(0.0f);
    return glm::vec3(std::max(0.0, 1.0 - kNoiseLeft * noise / squares) / weights * light);
}

}  // namespace

void set_corrections(std::vector<Record>& records, const SplatSettings& options, ThreadPool& pool)
{
    std::vector<Voice> voices;
    voices.reserve(records.size());
    for (std::uint32_t i = 0; i < records.size(); ++i) {
        records[i].correction = glm::vec3(0.0f);
        const float radius = influence_radius(records[i], options.overlap);
        if (radius > 0.0f) voices.push_back({&records[i], radius, i});
    }
    BlockTree tree(std::move(voices));
    std::vector<Block>& blocks = tree.blocks();
    // Shows `visit` each block's records, and what is around.
    const auto for_each = [&](const auto& visit) {
        pool.parallel_for(blocks.size(), 16, [&](std::size_t begin, std::size_t end, int) {
            std::vector<std::uint32_t> near;
            for (std::size_t b = begin; b < end; ++b) {
                tree.find_around(blocks[b], near);
                for (std::size_t l = 0; l < blocks[b].count; ++l)
                    visit(blocks[b], l, near,
                          Place{at(blocks[b].position, l), at(blocks[b].normal, l),
                                1.0f / (options.error_tolerance * options.overlap)});
            }
        });
    };
    for_each([&](Block& block, std::size_t lane, const auto& near, const Place& here) {
        set_residual(blocks, near, here, block, lane);
    });
    for_each([&](const Block& block, std::size_t lane, const auto& near, const Place& here) {
        Record& r = records[block.number[lane]];
        r.correction = glm::max(correction(blocks, near, here), -r.irradiance);
    });
}

}  // namespace rcs
