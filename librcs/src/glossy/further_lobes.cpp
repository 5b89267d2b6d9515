#include "glossy/further_lobes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "util/color.h"

namespace rcs {
namespace {

constexpr int kSide = 16;  // of a square whose pixels say together how noisy lobes are [px]

/// Sums over its pixels.
struct SquareOfLobes {
    float error = 0.0f, light = 0.0f, reflectance = 0.0f;
};

/// Luminance of what lobes reflect, gathered lamps too.
float light_of(const TracedLight& traced, std::size_t i)
{
    return luminance(traced.radiance[i]) + (traced.of_lamps.empty() ? 0.0f : luminance(traced.of_lamps[i]));
}
/// Of that, as one round leaves it.
float error_of(const TracedLight& traced, std::size_t i)
{
    const float error =
        traced.of_lamps.empty() ? traced.error[i] : std::hypot(traced.error[i], traced.of_lamps_error[i]);
    return traced.variance.empty() ? error : error / std::sqrt(traced.variance[i]);
}

/// Of a round that is added to what is known, by their variances.
float share_of_next(const TracedLight& known, std::size_t i) { return known.variance[i] / (1.0f + known.variance[i]); }

class Squares {
public:
    explicit Squares(const GBuffer& g)
        : width_(static_cast<std::size_t>(g.width)), columns_(count(g.width)), squares_(columns_ * count(g.height))
    {
    }
    SquareOfLobes& of(std::size_t pixel)
    {
        return squares_[pixel / width_ / kSide * columns_ + pixel % width_ / kSide];
    }

private:
    static std::size_t count(int pixels) { return static_cast<std::size_t>((pixels + kSide - 1) / kSide); }

    std::size_t width_, columns_;
    std::vector<SquareOfLobes> squares_;
};

}  // namespace

std::vector<std::uint8_t> further_rounds(const GBuffer& g, const Shading& shading, const TracedLight& traced,
                                         const std::vector<float>& beside, const FurtherLobes& settings)
{
    Squares squares(g);
    const auto is_traced = [&](std::size_t i) {
        return g.covered(i) && shading.is_traced(i) && luminance(traced.reflectance[i]) > 0.0f;
    };
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (!is_traced(i)) continue;
        SquareOfLobes& square = squares.of(i);
        square.error += error_of(traced, i);
        square.light += light_of(traced, i);
        square.reflectance += luminance(traced.reflectance[i]);
    }
    std::vector<std::uint8_t> rounds(g.size(), 0);
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (!is_traced(i)) continue;
        const SquareOfLobes& square = squares.of(i);
        const float part = luminance(traced.reflectance[i]) / square.reflectance;
        const float light = beside[i] + part * square.light;
        if (!(light > 0.0f)) continue;
        const float times = part * square.error / (settings.allowed * light);
        const float had = traced.variance.empty() ? 1.0f : 1.0f / traced.variance[i];
        rounds[i] =
            static_cast<std::uint8_t>(std::clamp(std::round(times - had), 0.0f, static_cast<float>(settings.most)));
    }
    return rounds;
}

void add_round(TracedLight& light, const TracedLight& more, const std::vector<std::uint8_t>* had)
{
    if (light.variance.empty()) light.variance.assign(light.radiance.size(), 1.0f);
    for (TracedAgain& again : light.again) {
        if (more.again.empty() || again.pixel == GBuffer::kNone || (had && (*had)[again.pixel] == 0)) continue;
        const TracedAgain& next = more.again[static_cast<std::size_t>(&again - light.again.data())];
        const float share = share_of_next(light, again.pixel);
        for (std::size_t n = 0; n < 2; ++n) {
            again.radiance[n] = glm::mix(again.radiance[n], next.radiance[n], share);
            again.of_lamps[n] = glm::mix(again.of_lamps[n], next.of_lamps[n], share);
        }
    }
    const auto add = [&](std::size_t i, float share, std::vector<glm::vec3>& sum, std::vector<float>& errors,
                         const std::vector<glm::vec3>& next, const std::vector<float>& next_errors) {
        sum[i] = glm::mix(sum[i], next[i], share);
        errors[i] = std::hypot((1.0f - share) * errors[i], share * next_errors[i]);
    };
    // As each pixel found it: they put together what all rounds found.
    const bool is_apart = !light.apart.radiance.empty();
    std::vector<glm::vec3>& radiance = is_apart ? light.apart.radiance : light.radiance;
    std::vector<float>& error = is_apart ? light.apart.error : light.error;
    std::vector<glm::vec3>& of_lamps = is_apart ? light.apart.of_lamps : light.of_lamps;
    std::vector<float>& of_lamps_error = is_apart ? light.apart.of_lamps_error : light.of_lamps_error;
    for (std::size_t i = 0; i < light.radiance.size(); ++i) {
        if (had && (*had)[i] == 0) continue;
        const float share = share_of_next(light, i);
        add(i, share, radiance, error, more.radiance, more.error);
        if (!of_lamps.empty()) add(i, share, of_lamps, of_lamps_error, more.of_lamps, more.of_lamps_error);
        light.variance[i] = share;  // over that of one round: 1/2, 1/3, ...
    }
}

}  // namespace rcs
