#include "glossy/past_lobes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "glossy/lobe_sharing.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr int kMostFewer = 4;
// What surfaces reflect into a lobe changes by about so much of it as the lobe turns by its width: unlike lamps, they
// are all around.
constexpr float kChange = 0.3f;

}  // namespace

PastLobes::PastLobes(const PastTraced* past, const GBuffer& g, const Shading& shading, ThreadPool& pool)
    : past_(past), fewer_(past ? g.size() : 0, 1)
{
    if (!past) return;
    const auto fewer_at = [&](std::size_t i) {
        if (!past->places[i].is_seen() || looks_through(shading.bsdf(g, i))) return 1;
        std::array<float, 4> light{};
        float mean = 0.0f, variance = 0.0f;
        const std::array<std::size_t, 4> around = past->places.around(i);
        for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t j = around[k];
            light[k] = luminance(past->light.radiance[j]);
            variance += 0.25f * past->light.error[j] * past->light.error[j];
            if (!past->light.of_lamps.empty()) {
                light[k] += luminance(past->light.of_lamps[j]);
                variance += 0.25f * past->light.of_lamps_error[j] * past->light.of_lamps_error[j];
            }
            mean += 0.25f * light[k];
        }
        const float all = past->places.mean(past->all, i);
        const int views = past->places.views(i, all > 0.0f ? kChange * mean / all : 0.0f);
        return is_even(light, std::sqrt(variance), all) ? std::min(kMostFewer, views) : 1;
    };
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            if (g.covered(i) && shading.is_traced(i)) fewer_[i] = static_cast<std::uint8_t>(fewer_at(i));
    });
}

void PastLobes::add_to(TracedLight& light) const
{
    if (!past_) return;
    light.variance.assign(fewer_.size(), 1.0f);
    for (std::size_t i = 0; i < fewer_.size(); ++i) {
        if (fewer_[i] == 1) continue;
        const auto now = static_cast<float>(fewer_[i]);
        const float known = past_->light.variance.empty() ? 1.0f : past_->places.mean(past_->light.variance, i);
        const PastMix mix = mix_of(known, now, 1.0f / now);
        const float error = std::sqrt(mix.variance / now);
        const auto add = [&](const std::vector<glm::vec3>& before, std::vector<glm::vec3>& radiance,
                             std::vector<float>& errors) {
            if (radiance.empty()) return;
            radiance[i] = mix_with_past(past_->places.mean(before, i), radiance[i], mix.weight);
            errors[i] *= error;
        };
        add(past_->light.radiance, light.radiance, light.error);
        add(past_->light.of_lamps, light.of_lamps, light.of_lamps_error);
        light.variance[i] = mix.variance;
    }
}

}  // namespace rcs
