#include "splat/corrections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <glm/glm.hpp>

#include "splat/blocked_records.h"
#include "splat/gpu_records.h"
#include "util/color.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

// Smoothed residuals say how light bends as far as they are larger than this part of the noise that a splat leaves: of
// white noise they hold a sixth, and .5 has the least error, but leaves more of the bend (docs/method.md, Light between
// records).
constexpr double kOfNoise = 0.15;

constexpr std::size_t kLanes = RecordBlock::kLanes;
using Lanes = RecordBlock::Lanes;

/// What a block's records say, as a splat reads it, side by side; and what a splat is off by at them.
struct BlockLight {
    Lanes irradiance[3], translation[3][3], rotation[3][3];  // by colour
    std::array<glm::dvec3, kLanes> residual;                 // what the record holds and the splat does not say
    std::array<double, kLanes> variance;                     // of the record's luminance, by its own word
    std::array<double, kLanes> splat_variance;               // ... of what the splat says there
    std::array<glm::dvec3, kLanes> bend;                     // residuals around, smoothed
};

void put(BlockLight& light, std::size_t lane, const Record& r)
{
    for (std::size_t c = 0; c < 3; ++c) {
        const int colour = static_cast<int>(c);
        light.irradiance[c][lane] = r.irradiance[colour];
        for (int i = 0; i < 3; ++i) {
            light.translation[c][i][lane] = r.gradient_scale * r.translation_gradient[c][i];
            light.rotation[c][i][lane] = r.rotation_gradient[c][i];
        }
    }
    const double deviation = static_cast<double>(r.noise) * static_cast<double>(luminance(r.irradiance));
    light.variance[lane] = deviation * deviation;
}

/// What the block's records say of the light there, times their weight.
RCS_MULTIVERSION
void extrapolate(const RecordBlock& block, const BlockLight& of, const WeighedAt& here, const float* weight,
                 Lanes* light)
{
    for (std::size_t c = 0; c < 3; ++c) {
        RCS_WHOLE_LOOP
        for (std::size_t l = 0; l < kLanes; ++l) {
            const gpu::vec3 n = lane_of(block.normal, l);
            const gpu::vec3 d{here.position.x - block.position[0][l], here.position.y - block.position[1][l],
                              here.position.z - block.position[2][l]};
            const gpu::vec3 turn{n.y * here.normal.z - n.z * here.normal.y, n.z * here.normal.x - n.x * here.normal.z,
                                 n.x * here.normal.y - n.y * here.normal.x};
            light[c][l] = weight[l] * gpu::rcs_extrapolate(of.irradiance[c][l], d, turn, lane_of(of.translation[c], l),
                                                           lane_of(of.rotation[c], l));
        }
    }
}

/// Records, and what they say.
struct Said {
    BlockedRecords blocks;
    std::vector<BlockLight> light;
};

Said make_said(std::span<const Record> records, float overlap)
{
    std::vector<Voice> voices;
    voices.reserve(records.size());
    for (std::uint32_t i = 0; i < records.size(); ++i)
        if (const float radius = influence_radius(records[i], overlap); radius > 0.0f)
            voices.push_back({records[i].position, records[i].normal, radius, i});
    Said said{BlockedRecords(std::move(voices)), {}};
    said.light.resize(said.blocks.list().size());
    for (std::size_t b = 0; b < said.light.size(); ++b) {
        const RecordBlock& block = said.blocks.list()[b];
        for (std::size_t l = 0; l < block.count; ++l) put(said.light[b], l, records[block.number[l]]);
    }
    return said;
}

void set_residual(const Said& said, std::span<const std::uint32_t> near, const WeighedAt& here, BlockLight& light,
                  std::size_t lane)
{
    glm::dvec3 sum(0.0);
    double weights = 0.0, variance = 0.0;
    said.blocks.for_each_around(near, here, [&](std::uint32_t b, const Lanes& weight) {
        Lanes around[3];
        extrapolate(said.blocks.list()[b], said.light[b], here, weight, around);
        for (std::size_t l = 0; l < said.blocks.list()[b].count; ++l) {
            if (!(weight[l] > 0.0f)) continue;
            const auto w = static_cast<double>(weight[l]);
            sum += glm::dvec3(around[0][l], around[1][l], around[2][l]);
            weights += w;
            variance += w * w * said.light[b].variance[l];
        }
    });
    for (int c = 0; c < 3; ++c)
        light.residual[lane][c] = static_cast<double>(light.irradiance[c][lane]) - sum[c] / weights;
    light.splat_variance[lane] = variance / (weights * weights);
}

/// Shows `add` all records around that weigh something: what they say, the lane and the weight.
template <typename Add>
void for_each_lane(const Said& said, std::span<const std::uint32_t> near, const WeighedAt& here, const Add& add)
{
    said.blocks.for_each_around(near, here, [&](std::uint32_t b, const Lanes& weight) {
        for (std::size_t l = 0; l < said.blocks.list()[b].count; ++l)
            if (weight[l] > 0.0f) add(said.light[b], l, static_cast<double>(weight[l]));
    });
}

/// The residuals around, smoothed.
glm::dvec3 bend(const Said& said, std::span<const std::uint32_t> near, const WeighedAt& here)
{
    glm::dvec3 light(0.0);
    double weights = 0.0;
    for_each_lane(said, near, here, [&](const BlockLight& other, std::size_t l, double w) {
        light += w * other.residual[l];
        weights += w;
    });
    return light / weights;
}

/// How much of the bends around is more than noise.
double share_of_bends(const Said& said, std::span<const std::uint32_t> near, const WeighedAt& here)
{
    double squares = 0.0, noise = 0.0;
    for_each_lane(said, near, here, [&](const BlockLight& other, std::size_t l, double w) {
        const auto y = static_cast<double>(luminance(glm::vec3(other.bend[l])));
        squares += w * y * y;
        noise += w * other.splat_variance[l];
    });
    if (!(squares > 0.0 && std::isfinite(squares))) return 0.0;
    return std::max(0.0, 1.0 - kOfNoise * noise / squares);
}

}  // namespace

void set_corrections(std::vector<Record>& records, const SplatSettings& options, ThreadPool& pool)
{
    for (Record& r : records) r.correction = glm::vec3(0.0f);
    Said said = make_said(records, options.overlap);
    const float tolerance = options.error_tolerance * options.overlap;
    said.blocks.for_each(tolerance, pool, [&](std::size_t b, std::size_t lane, auto near, const WeighedAt& here) {
        set_residual(said, near, here, said.light[b], lane);
    });
    said.blocks.for_each(tolerance, pool, [&](std::size_t b, std::size_t lane, auto near, const WeighedAt& here) {
        said.light[b].bend[lane] = bend(said, near, here);
    });
    said.blocks.for_each(tolerance, pool, [&](std::size_t b, std::size_t lane, auto near, const WeighedAt& here) {
        Record& r = records[said.blocks.list()[b].number[lane]];
        const double share = share_of_bends(said, near, here);
        if (!(share > 0.0)) return;
        r.correction = glm::max(glm::vec3(share * said.light[b].bend[lane]), -r.irradiance);
    });
}

}  // namespace rcs
