#include "lamps/candidates.h"

#include <algorithm>

#include "util/color.h"

namespace rcs {

LampCandidates::LampCandidates(const Lights& lights, std::size_t most, bool with_punctual)
    : first_(with_punctual ? 0u : static_cast<std::uint32_t>(lights.punctual.size())),
      count_(static_cast<std::uint32_t>(lights.punctual.size() + lights.triangles.size()) - first_),
      punctual_(static_cast<std::uint32_t>(lights.punctual.size())),
      most_(most),
      tree_(lights.tree)
{
    double sum = 0.0;
    for (const PunctualLamp& light : lights.punctual) power_cdf_.push_back(sum += luminance(light.intensity));
}

std::size_t LampCandidates::draw_punctual(float offset, std::size_t room, std::span<LampCandidate> candidates) const
{
    std::size_t count = 0;
    const double step = power_cdf_.back() / static_cast<double>(room);
    for (std::size_t i = 0; i < room; ++i) {
        const double target = step * (static_cast<double>(i) + static_cast<double>(offset));
        const auto found = std::upper_bound(power_cdf_.begin(), power_cdf_.end() - 1, target);
        const std::size_t lamp = static_cast<std::size_t>(found - power_cdf_.begin());
        const double share = power_cdf_[lamp] - (lamp > 0 ? power_cdf_[lamp - 1] : 0.0);
        if (share > 0.0) candidates[count++] = {static_cast<std::uint32_t>(lamp), static_cast<float>(step / share)};
    }
    return count;
}

std::size_t LampCandidates::draw(glm::vec3 point, glm::vec3 normal, float offset,
                                 std::span<LampCandidate> candidates) const
{
    std::size_t count = 0;
    if (!draws()) {
        for (; count < count_; ++count) candidates[count] = {first_ + static_cast<std::uint32_t>(count), 1.0f};
        return count;
    }
    const std::uint32_t punctual = punctual_ - first_;
    const bool has_triangles = count_ > punctual;
    const std::size_t room = has_triangles ? most_ / 2 : most_;
    if (punctual > room) {
        count = draw_punctual(offset, room, candidates);
    } else {
        for (; count < punctual; ++count) candidates[count] = {first_ + static_cast<std::uint32_t>(count), 1.0f};
    }
    if (has_triangles) {
        const std::size_t drawn = tree_->draw(point, normal, offset, candidates.subspan(count, most_ - count));
        for (std::size_t end = count + drawn; count < end; ++count) candidates[count].lamp += punctual_;
    }
    return count;
}

}  // namespace rcs
