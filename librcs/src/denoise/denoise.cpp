#include "denoise/denoise.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "compose/sampled_light.h"
#include "denoise/mixture.h"
#include "rcs/metrics.h"
#include "util/color.h"

namespace rcs {
namespace {

using At = SampledChannels;

// What no light is divided by less than, for what is hardly reflected to be no noise of its own.
constexpr float kLeastReflectance = 1e-3f;

struct NamedKind {
    const char* name;
    SampledLight::Kind kind;
    std::size_t reflectance;  ///< its channels
    const char* layer;        ///< that the light is part of
    const char* error_layer;
};
constexpr NamedKind kKinds[] = {
    {"direct", SampledLight::diffuse, At::kDiffuseReflectance, "direct", "direct_error"},
    {"highlights", SampledLight::highlights, At::kLobeReflectance, "direct", "direct_error"},
    {"reflections", SampledLight::reflections, At::kLobeReflectance, "indirect", "indirect_error"},
};

glm::vec3 color_at(const float* p) { return {p[0], p[1], p[2]}; }

/// The layer, read by pixel.
class Sampled {
public:
    explicit Sampled(const Image& image) : image_(image) {}
    std::size_t pixels() const { return image_.pixels.size() / At::kAll; }
    int width() const { return image_.width; }
    int height() const { return image_.height; }
    glm::vec3 color(std::size_t pixel, std::size_t channel) const { return color_at(&at(pixel, channel)); }
    const float* of(const NamedKind& kind, std::size_t pixel) const { return &at(pixel, kind.kind * At::kOfKind); }
    std::vector<glm::vec3> colors(std::size_t channel) const
    {
        std::vector<glm::vec3> all(pixels());
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = color(i, channel);
        return all;
    }

private:
    const float& at(std::size_t pixel, std::size_t channel) const { return image_.pixels[pixel * At::kAll + channel]; }
    const Image& image_;
};

/// One kind of light as it was sampled, and what the picture shows of it.
struct KindOfLight {
    std::vector<glm::vec3> sampled, shown;
    std::vector<double> error_before, error_after;  // standard errors of luminance
    std::vector<double> others;                     // all that errors are relative to, without this light
    bool any = false;

    KindOfLight(const NamedKind& kind, const Sampled& from, const Image& beauty)
        : sampled(from.pixels()), error_before(from.pixels()), others(from.pixels())
    {
        double sum = 0.0;
        for (std::size_t i = 0; i < sampled.size(); ++i) {
            const float* const p = from.of(kind, i);
            sampled[i] = color_at(p + At::kLight);
            error_before[i] = std::sqrt(static_cast<double>(p[At::kSquaredError]));
            any = any || sampled[i] != glm::vec3(0.0f);
            others[i] = static_cast<double>(luminance(color_at(beauty.pixels.data() + 4 * i)));
            sum += others[i];
        }
        const double dark = kRelativeErrorFloor * sum / static_cast<double>(sampled.size());
        for (std::size_t i = 0; i < sampled.size(); ++i)
            others[i] = dark + std::max(0.0, others[i] - static_cast<double>(luminance(sampled[i])));
        shown = sampled;
        error_after = error_before;
    }
    /// What errors at a pixel are relative to. @param light  of this kind
    double all_light(const std::vector<glm::vec3>& light, std::size_t i) const
    {
        return others[i] + static_cast<double>(luminance(light[i]));
    }
};

std::vector<glm::vec3> filter(const Oidn& oidn, const Sampled& from, const NamedKind& kind,
                              const std::vector<glm::vec3>& light)
{
    const std::vector<glm::vec3> reflectance = from.colors(kind.reflectance);
    std::vector<glm::vec3> arriving(light.size()), normal = from.colors(At::kNormal);
    for (std::size_t i = 0; i < light.size(); ++i) arriving[i] = light[i] / (reflectance[i] + kLeastReflectance);
    std::vector<glm::vec3> filtered = oidn.filter(from.width(), from.height(), arriving, reflectance, normal);
    for (std::size_t i = 0; i < light.size(); ++i) {
        filtered[i] *= reflectance[i] + kLeastReflectance;
        for (int c = 0; c < 3; ++c)
            if (!(filtered[i][c] >= 0.0f) || !std::isfinite(filtered[i][c])) filtered[i][c] = light[i][c];
    }
    return filtered;
}

bool is_noisy(const float* of_kind) { return of_kind[At::kSquaredError] > 0.0f || of_kind[At::kNoisy] > 0.0f; }

FilterMixture check(const CheckedPixels& checked, const Sampled& from, const NamedKind& kind, const KindOfLight& light,
                    const std::vector<glm::vec3>& filtered)
{
    std::vector<FilterCheck> checks;
    for (std::size_t square = 0; square < checked.squares(); ++square) {
        const std::uint32_t i = checked.pixel(square);
        if (i == CheckedPixels::kNone || !is_noisy(from.of(kind, i))) continue;
        const float* const again = from.of(kind, i) + At::kAgain;
        const double there = light.all_light(filtered, i);
        checks.push_back({static_cast<double>(luminance(light.sampled[i])),
                          static_cast<double>(luminance(filtered[i])),
                          {static_cast<double>(again[0]), static_cast<double>(again[1])},
                          light.error_before[i],
                          there});
    }
    return FilterMixture(std::move(checks));
}

/// Fills in what is shown. @return the part that is filtered, of noisy pixels
double mix(const FilterMixture& mixture, const Sampled& from, const NamedKind& kind,
           const std::vector<glm::vec3>& filtered, KindOfLight& light)
{
    double part = 0.0, noisy = 0.0;
    for (std::size_t i = 0; i < filtered.size(); ++i) {
        if (!is_noisy(from.of(kind, i))) continue;
        const double there = light.all_light(filtered, i), relative = light.error_before[i] / there;
        const double share = mixture.filtered(relative);
        noisy += 1.0, part += share;
        if (!(share > 0.0)) continue;
        light.shown[i] = glm::mix(light.sampled[i], filtered[i], static_cast<float>(share));
        light.error_after[i] = mixture.left(relative) * there;
    }
    return noisy > 0.0 ? part / noisy : 0.0;
}

/// Puts what is shown in the place of what was sampled.
void exchange(const NamedKind& kind, const KindOfLight& light, LayeredImage& image)
{
    const auto layer = image.layers.find(kind.layer), errors = image.layers.find(kind.error_layer);
    for (std::size_t i = 0; i < light.shown.size(); ++i) {
        if (light.shown[i] == light.sampled[i]) continue;
        for (std::size_t c = 0; layer != image.layers.end() && c < 3; ++c) {
            const auto channel = static_cast<glm::length_t>(c);
            float& value = layer->second.pixels[3 * i + c];
            value = std::max(0.0f, value + (light.shown[i][channel] - light.sampled[i][channel]));
        }
        if (errors == image.layers.end()) continue;
        float& error = errors->second.pixels[i];
        const auto all = static_cast<double>(error);
        const double others = std::max(0.0, all * all - light.error_before[i] * light.error_before[i]);
        error = static_cast<float>(std::sqrt(others + light.error_after[i] * light.error_after[i]));
    }
}

}  // namespace

DenoiseStats denoise(const Oidn& oidn, const CheckedPixels& checked, LayeredImage& image)
{
    DenoiseStats stats{oidn.library(), oidn.device(), {}, {}};
    const Image layer = std::move(image.layers.at(kSampledLayer));
    image.layers.erase(kSampledLayer);
    const Sampled from(layer);
    for (const NamedKind& kind : kKinds) {
        KindOfLight light(kind, from, image.layers.at("beauty"));
        if (!light.any) continue;
        DenoisedLight& done = stats.lights.emplace_back(DenoisedLight{.name = kind.name});
        const auto differs = [](double error) { return error > 0.0; };
        done.is_exact = std::none_of(light.error_before.begin(), light.error_before.end(), differs);
        if (done.is_exact) continue;
        const std::vector<glm::vec3> filtered = filter(oidn, from, kind, light.sampled);
        const FilterMixture mixture = check(checked, from, kind, light, filtered);
        done.filtered = mix(mixture, from, kind, filtered, light);
        done.error_before = mixture.error_before();
        done.error_after = mixture.error_after();
        exchange(kind, light, image);
    }
    add_up_beauty(image);
    return stats;
}

}  // namespace rcs
