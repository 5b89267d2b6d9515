#include "splat/blocked_records.h"

#include <limits>

#include "util/median_split.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

void put(RecordBlock& block, std::size_t lane, const Voice& voice)
{
    for (int i = 0; i < 3; ++i) block.position[i][lane] = voice.position[i], block.normal[i][lane] = voice.normal[i];
    block.inverse_radius[lane] = 1.0f / voice.radius;
    block.is_there[lane] = 1.0f;
    block.number[lane] = voice.number;
}

RCS_MULTIVERSION
bool weigh_lanes(const RecordBlock& block, const WeighedAt& here, float* weight)
{
    int reached = 0;
    RCS_WHOLE_LOOP
    for (std::size_t l = 0; l < RecordBlock::kLanes; ++l) {
        const gpu::vec3 d{here.position.x - block.position[0][l], here.position.y - block.position[1][l],
                          here.position.z - block.position[2][l]};
        weight[l] =
            block.is_there[l] * gpu::rcs_interpolation_weight(d, here.normal, lane_of(block.normal, l),
                                                              block.inverse_radius[l], here.inverse_normal_tolerance);
        reached |= weight[l] > 0.0f;
    }
    return reached != 0;
}

}  // namespace

bool weigh(const RecordBlock& block, const WeighedAt& here, float* weight) { return weigh_lanes(block, here, weight); }

BlockedRecords::BlockedRecords(std::vector<Voice> voices)
{
    if (!voices.empty()) build(voices, 0, voices.size());
}

void BlockedRecords::find_around(const RecordBlock& block, std::vector<std::uint32_t>& found) const
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

std::uint32_t BlockedRecords::build(std::vector<Voice>& voices, std::size_t begin, std::size_t end)
{
    constexpr float kNowhere = std::numeric_limits<float>::infinity();
    const auto id = static_cast<std::uint32_t>(nodes_.size());
    Node node{glm::vec3(kNowhere), glm::vec3(-kNowhere), static_cast<std::uint32_t>(blocks_.size()), 0};
    for (std::size_t k = begin; k < end; ++k) {
        node.low = glm::min(node.low, voices[k].position - voices[k].radius);
        node.high = glm::max(node.high, voices[k].position + voices[k].radius);
    }
    nodes_.push_back(node);
    if (end - begin <= RecordBlock::kLanes) {
        RecordBlock& block = blocks_.emplace_back();
        block.count = end - begin;
        block.low = node.low, block.high = node.high;
        for (std::size_t k = begin; k < end; ++k) put(block, k - begin, voices[k]);
        return id;
    }
    const std::size_t middle = split_at_median(voices, begin, end, node.high - node.low,
                                               [](const Voice& v) -> const glm::vec3& { return v.position; });
    build(voices, begin, middle);
    const std::uint32_t right = build(voices, middle, end);
    nodes_[id].right = right;
    return id;
}

}  // namespace rcs
