#include "light/candidates.h"

#include <algorithm>

#include "util/color.h"

namespace rcs {
namespace {

double power(const EmissiveTriangle& triangle)
{
    return static_cast<double>(luminance(triangle.radiance)) * triangle.area * (triangle.double_sided ? 2.0 : 1.0);
}

}  // namespace

LampCandidates::LampCandidates(const Lights& lights, std::size_t most, bool with_punctual)
    : first_(with_punctual ? 0u : static_cast<std::uint32_t>(lights.punctual.size())),
      count_(static_cast<std::uint32_t>(lights.punctual.size() + lights.triangles.size()) - first_), most_(most)
{
    if (count_ <= most)
        return;
    double sum = 0.0;
    if (with_punctual)
        for (const PunctualLamp& light : lights.punctual)
            power_cdf_.push_back(sum += luminance(light.intensity));
    for (const EmissiveTriangle& triangle : lights.triangles)
        power_cdf_.push_back(sum += power(triangle));
}

std::size_t LampCandidates::draw(float offset, std::span<LampCandidate> candidates) const
{
    if (power_cdf_.empty()) {
        for (std::uint32_t i = 0; i < count_; ++i)
            candidates[i] = {first_ + i, 1.0f};
        return count_;
    }
    std::size_t count = 0;
    const double step = power_cdf_.back() / static_cast<double>(most_);
    for (std::size_t i = 0; i < most_; ++i) {
        const double target = step * (static_cast<double>(i) + static_cast<double>(offset));
        const auto found = std::upper_bound(power_cdf_.begin(), power_cdf_.end() - 1, target);
        const std::size_t lamp = static_cast<std::size_t>(found - power_cdf_.begin());
        const double share = power_cdf_[lamp] - (lamp > 0 ? power_cdf_[lamp - 1] : 0.0);
        if (share > 0.0)
            candidates[count++] = {first_ + static_cast<std::uint32_t>(lamp), static_cast<float>(step / share)};
    }
    return count;
}

}  // namespace rcs
