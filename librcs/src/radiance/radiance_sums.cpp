#include "radiance/radiance_sums.h"

#include <algorithm>
#include <cstddef>

namespace rcs {
namespace {

/// Adds one packet's radiance times its harmonics.
RCS_MULTIVERSION
void add_packet(const detail::HarmonicFactors& factors, const RayPacket& ray, const float* red, const float* green,
                const float* blue, HarmonicLanes* sums)
{
    HarmonicLanes y;
    evaluate_harmonics(factors, ray.direction_x, ray.direction_y, ray.direction_z, y);
    for (int k = 0; k < kHarmonics; ++k) {
        for (int i = 0; i < kHarmonicLanes; ++i) {
            sums[0][k][i] += red[i] * y[k][i];
            sums[1][k][i] += green[i] * y[k][i];
            sums[2][k][i] += blue[i] * y[k][i];
        }
    }
}

/// Sums over the lanes, by halves: short chains, and the same order for every vector width.
RCS_MULTIVERSION
void sum_lanes(const HarmonicLanes& lanes, float weight, float* sums)
{
    for (int k = 0; k < kHarmonics; ++k) {
        float half[kHarmonicLanes / 2];
        for (int i = 0; i < kHarmonicLanes / 2; ++i) half[i] = lanes[k][i] + lanes[k][i + kHarmonicLanes / 2];
        const float a = half[0] + half[4], b = half[1] + half[5], c = half[2] + half[6], d = half[3] + half[7];
        sums[k] = weight * ((a + c) + (b + d));
    }
}

}  // namespace

void RadianceSums::clear()
{
    for (HarmonicLanes& color : lanes_)
        for (auto& lanes : color) std::fill(lanes, lanes + kHarmonicLanes, 0.0f);
}

void RadianceSums::add(const RayPacket& ray, const float* red, const float* green, const float* blue)
{
    add_packet(detail::harmonic_factors(), ray, red, green, blue, lanes_);
}

std::vector<float> RadianceSums::coefficients(float weight) const
{
    std::vector<float> result(3 * kHarmonics);
    for (std::size_t color = 0; color < 3; ++color)
        sum_lanes(lanes_[color], weight, result.data() + color * kHarmonics);
    return result;
}

}  // namespace rcs
