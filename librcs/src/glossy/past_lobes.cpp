#include "glossy/past_lobes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "glossy/lobe_reach.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Two rays are the fewest whose difference tells of their error.
constexpr int most_fewer(int rays) { return rays >= 8 ? 4 : rays >= 4 ? 2 : 1; }
// What surfaces reflect into a lobe changes by about so much of it as the lobe turns by its width: unlike lamps, they
// are all around.
constexpr float kChange = 0.3f;
// What shows in a plane: points are off it by so many footprints at the most, lobes as wide but for so much...
constexpr float kOffPlane = 0.5f, kSameWidth = 0.1f;
// What lobes reflect, apart from how much of it: that is known of a lobe so many times as bright or dark, no more, and
// whose widths differ by so much.
constexpr float kMostBrighter = 2.0f, kMostWider = 2.0f;
// ... and it shows where it is looked for but for so much [px], and so much of what the lobe blurs it by.
constexpr double kSamePixel = 0.5, kOfBlur = 0.1;
// Of four pixels, those that have other lobes are left out: what is left of the mean is so much at the least. A slow
// walk in veach-ajar: .157 million rays a frame if all four have to be alike, .139 with anything from .01 to .7.
constexpr float kLeastAlike = 0.5f;
constexpr std::uint8_t kAll = 15;
// Farther off than so many times the point: as good as infinitely far.
constexpr double kFar = 1e4;

/// A colour times another's over a third one.
glm::vec3 recoloured(glm::vec3 light, glm::vec3 now, glm::vec3 before)
{
    for (int c = 0; c < 3; ++c) light[c] = before[c] > 0.0f ? light[c] * now[c] / before[c] : 0.0f;
    return light;
}

bool are_alike(glm::vec3 a, glm::vec3 b)
{
    // A channel of which a metal reflects next to nothing counts for as little.
    const glm::vec3 least(0.01f * (luminance(a) + luminance(b)));
    return glm::all(glm::lessThanEqual(a, kMostBrighter * b + least)) &&
           glm::all(glm::lessThanEqual(b, kMostBrighter * a + least));
}

/// From an observer at 0 to what a plane shows behind one of its points, as far beyond it.
glm::dvec3 behind(glm::dvec3 point, double distance)
{
    const double away = glm::length(point);
    return point * (1.0 + std::min(distance, kFar * away) / away);
}

}  // namespace

PastLobes::PastLobes(const LobeSettings& options, const GBuffer& g, const View& view, const Shading& shading,
                     ThreadPool& pool)
    : options_(options),
      past_(options.past),
      g_(g),
      view_(view),
      projection_(view),
      pixel_(image_plane(view).pixel),
      shading_(shading),
      most_fewer_(most_fewer(options.rays_per_pixel)),
      turn_(mix64(options.seed) >> 32),
      known_(past_ && most_fewer_ > 1 ? g.size() : 0)
{
    if (known_.empty()) return;
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            if (g.covered(i) && shading.is_traced(i)) known_[i] = find(i);
    });
}

PastLobes::Known PastLobes::find(std::size_t i) const
{
    const PastPlace& place = past_->places[i];
    if (!place.is_seen() || looks_through(shading_.bsdf(g_, i))) return {};
    if (const std::uint8_t alike = alike_at(i, place); alike != 0 && is_known(those(alike, place), place)) {
        const int views = past_->places.views(i, kChange * part_of_lobes(those(alike, place), place));
        if (views > 1) return {place, alike, static_cast<std::uint8_t>(std::min(most_fewer_, views))};
    }
    const PastPlace image = image_of(i);
    if (!image.is_seen()) return {};
    const std::uint8_t alike = alike_at(i, image);
    if (alike == 0 || !is_known(those(alike, image), image)) return {};
    return {image, alike, static_cast<std::uint8_t>(most_fewer_), true};
}

template <typename Value>
auto PastLobes::mean(const Alike& alike, const Value& value)
{
    auto sum = alike.part[0] * value(alike.pixel[0]);
    for (std::size_t k = 1; k < 4; ++k) sum += alike.part[k] * value(alike.pixel[k]);
    return sum;
}

PastLobes::Alike PastLobes::those(std::uint8_t which, const PastPlace& p) const
{
    Alike alike{past_->places.around(p),
                {(1.0f - p.y) * (1.0f - p.x), (1.0f - p.y) * p.x, p.y * (1.0f - p.x), p.y * p.x}};
    float sum = 0.0f;
    for (std::size_t k = 0; k < 4; ++k) {
        if ((which >> k & 1u) == 0u) alike.part[k] = 0.0f;
        sum += alike.part[k];
    }
    for (float& part : alike.part) part /= sum;
    return alike;
}

std::uint8_t PastLobes::alike_at(std::size_t i, const PastPlace& place) const
{
    const Bsdf bsdf = shading_.bsdf(g_, i);
    const glm::vec3 reflectance = albedo(bsdf, outgoing_at(g_, view_.camera, i), bsdf.those(lit_by_rays));
    const float width = shading_.traced[i];
    const Alike all = those(kAll, place);
    float sum = 0.0f;
    std::uint8_t alike = 0;
    for (std::size_t k = 0; k < 4; ++k) {
        const glm::vec3 other = past_->light.reflectance[all.pixel[k]];
        const float its_width = past_->light.width[all.pixel[k]];
        // Where nothing was traced lobes reflect nothing.
        if (!(luminance(other) > 0.0f && are_alike(other, reflectance) && its_width <= kMostWider * width &&
              width <= kMostWider * its_width))
            continue;
        alike |= static_cast<std::uint8_t>(1u << k);
        sum += all.part[k];
    }
    return sum >= kLeastAlike ? alike : std::uint8_t{0};
}

/// Whether they know what lies between them.
bool PastLobes::is_known(const Alike& alike, const PastPlace& place) const
{
    std::array<glm::vec3, 4> light{};
    float variance = 0.0f, count = 0.0f;
    const glm::vec3 reflectance = mean(alike, [&](std::size_t j) { return past_->light.reflectance[j]; });
    glm::vec3 first(0.0f);
    for (std::size_t k = 0; k < 4; ++k) {
        if (!(alike.part[k] > 0.0f)) continue;
        const std::size_t j = alike.pixel[k];
        const glm::vec3 there = past_->light.reflectance[j];
        const float brighter = luminance(reflectance) / luminance(there);
        light[k] = recoloured(past_->light.radiance[j], reflectance, there);
        variance += brighter * brighter * past_->light.error[j] * past_->light.error[j];
        if (!past_->light.of_lamps.empty()) {
            light[k] += recoloured(past_->light.of_lamps[j], reflectance, there);
            variance += brighter * brighter * past_->light.of_lamps_error[j] * past_->light.of_lamps_error[j];
        }
        if (count == 0.0f) first = light[k];
        count += 1.0f;
    }
    for (std::size_t k = 0; k < 4; ++k)
        if (!(alike.part[k] > 0.0f)) light[k] = first;
    return is_even(light, std::sqrt(variance / count), past_->places.mean(past_->all, place));
}

/// Of all that is sampled.
float PastLobes::part_of_lobes(const Alike& alike, const PastPlace& place) const
{
    const bool of_lamps = !past_->light.of_lamps.empty();
    const float light = mean(alike, [&](std::size_t j) {
        return luminance(past_->light.radiance[j]) + (of_lamps ? luminance(past_->light.of_lamps[j]) : 0.0f);
    });
    const float all = past_->places.mean(past_->all, place);
    return all > 0.0f ? light / all : 0.0f;
}

/// What shows at the pixel, in the plane of its point, as far behind it as its rays went; relative to the earlier
/// camera.
glm::dvec3 PastLobes::image_at(std::size_t i, float distance) const
{
    return g_.camera_position - past_->places.points().camera_position +
           behind(glm::dvec3(g_.position(i)), static_cast<double>(distance));
}

/// Where the earlier view saw, in the plane of the point, the image that this view sees there.
PastPlace PastLobes::image_of(std::size_t i) const
{
    for (const View* view : {&view_, &past_->places.points().view})
        if (view->camera.projection == Projection::orthographic) return {};
    const glm::dvec3 at = image_at(i, past_->light.distance[past_->places.nearest(i)]);
    const PastPlace place = past_->places.project(at);
    if (!place.is_seen()) return {};
    const Bsdf bsdf = shading_.bsdf(g_, i);
    const Image image{glm::vec3(at), albedo(bsdf, outgoing_at(g_, view_.camera, i), bsdf.those(lit_by_rays))};
    const std::array<std::size_t, 4> around = past_->places.around(place);
    const bool shown =
        std::all_of(around.begin(), around.end(), [&](std::size_t before) { return shows_image(i, image, before); });
    return shown ? place : PastPlace{};
}

/// By how much a lobe blurs what it shows so far behind the point, seen from so far before it [px].
double PastLobes::blur_of(std::size_t i, double distance) const
{
    const auto width = static_cast<double>(shading_.traced[i]);
    const auto away = static_cast<double>(glm::length(g_.position(i)));
    return width * distance / (distance + away) / pixel_;
}

/// Whether a pixel of the earlier view lies in the plane of this one's point, has such a lobe, and met along it what
/// the image is of.
bool PastLobes::shows_image(std::size_t i, const Image& image, std::size_t before) const
{
    const PastPoints& past = past_->places.points();
    const glm::dvec3 to_now = past.camera_position - g_.camera_position;
    const glm::vec3 normal = g_.normal(i), there = past.position[before];
    const float width = shading_.traced[i];
    // A mirror that turns turns what it shows by twice that.
    const double turned = 2.0 * static_cast<double>(glm::length(past.normal[before] - normal));
    if (past.instance[before] != g_.instance[i] ||
        turned > kSamePixel * pixel_ + kOfBlur * static_cast<double>(width) ||
        std::abs(glm::dot(glm::dvec3(there) + to_now - glm::dvec3(g_.position(i)), glm::dvec3(normal))) >
            static_cast<double>(kOffPlane * g_.footprint[i]) ||
        std::abs(past_->light.width[before] - width) > kSameWidth * width ||
        !are_alike(past_->light.reflectance[before], image.reflectance))
        return false;
    // Where this view sees what showed there, were it as far behind the plane as it was met, or as the image is.
    const auto distance = static_cast<double>(glm::length(image.at - there));
    const auto shown_at = [&](double away) { return projection_.position(behind(glm::dvec3(there), away) + to_now); };
    const std::optional<glm::dvec2> as_met = shown_at(static_cast<double>(past_->light.distance[before])),
                                    as_image = shown_at(distance);
    return as_met && as_image && glm::length(*as_met - *as_image) <= kSamePixel + kOfBlur * blur_of(i, distance);
}

/// Whether what this view's own rays met, so far away, is what the image is of.
bool PastLobes::still_shows(std::size_t i, float distance) const
{
    const PastPlace &shown = past_->places.project(image_at(i, distance)), &known = known_[i].place;
    if (!shown.is_seen()) return false;
    const auto width = static_cast<std::uint32_t>(past_->places.points().view.width);
    const auto at = [&](const PastPlace& p) {
        return glm::dvec2(static_cast<double>(p.first % width) + static_cast<double>(p.x),
                          static_cast<double>(p.first / width) + static_cast<double>(p.y));
    };
    return glm::length(at(shown) - at(known)) <= kSamePixel + kOfBlur * blur_of(i, static_cast<double>(distance));
}

/// What was known at the four, had their lobes been as bright.
glm::vec3 PastLobes::mean_as(glm::vec3 reflectance, const std::vector<glm::vec3>& light, const Alike& alike) const
{
    return mean(alike, [&](std::size_t j) { return recoloured(light[j], reflectance, past_->light.reflectance[j]); });
}

void PastLobes::add_to(TracedLight& light) const
{
    if (known_.empty()) return;
    light.variance.assign(known_.size(), 1.0f);
    const auto all = static_cast<std::size_t>(options_.rays_per_pixel);
    for (std::size_t i = 0; i < known_.size(); ++i) {
        if (known_[i].fewer == 1) continue;
        const auto now = static_cast<float>(all) / static_cast<float>(rays(i, all));
        if (known_[i].is_image && !still_shows(i, light.distance[i])) {
            light.variance[i] = now;
            continue;
        }
        const Alike alike = those(known_[i].alike, known_[i].place);
        const float known =
            past_->light.variance.empty() ? 1.0f : mean(alike, [&](std::size_t j) { return past_->light.variance[j]; });
        const PastMix mix = mix_of(known, now, 1.0f / static_cast<float>(known_[i].fewer));
        const float error = std::sqrt(mix.variance / now);
        const auto add = [&](const std::vector<glm::vec3>& before, std::vector<glm::vec3>& radiance,
                             std::vector<float>& errors) {
            if (radiance.empty()) return;
            radiance[i] = glm::mix(mean_as(light.reflectance[i], before, alike), radiance[i], mix.weight);
            errors[i] *= error;
        };
        add(past_->light.radiance, light.radiance, light.error);
        add(past_->light.of_lamps, light.of_lamps, light.of_lamps_error);
        light.variance[i] = mix.variance;
    }
}

}  // namespace rcs
