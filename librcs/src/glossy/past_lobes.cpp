#include "glossy/past_lobes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "glossy/lobe_sharing.h"
#include "util/color.h"

namespace rcs {
namespace {

// ... but two rays are the fewest whose difference tells of their error.
constexpr int kMostFewer = 4, kFewestRays = 2;
// What surfaces reflect into a lobe changes by about so much of it as the lobe turns by its width: unlike lamps, they
// are all around.
constexpr float kChange = 0.3f;
// What shows in a plane: normals differ by no more, and points are off the plane by so many footprints...
constexpr float kFlat = 0.01f, kOffPlane = 0.5f;
// ... and it shows where it is looked for but for so much [px], and so much of what the lobe blurs it by.
constexpr double kSamePixel = 0.5, kOfBlur = 0.1;
// Farther off than so many times the point: as good as infinitely far.
constexpr double kFar = 1e4;

/// A colour times another's over a third one.
glm::vec3 recoloured(glm::vec3 light, glm::vec3 now, glm::vec3 before)
{
    for (int c = 0; c < 3; ++c) light[c] = before[c] > 0.0f ? light[c] * now[c] / before[c] : 0.0f;
    return light;
}

}  // namespace

/// The view that goes on.
struct PastLobes::Seen {
    const GBuffer& g;
    const View& view;
    const Shading& shading;
};

PastLobes::PastLobes(const LobeSettings& options, const GBuffer& g, const View& view, const Shading& shading,
                     ThreadPool& pool)
    : past_(options.past),
      most_fewer_(std::min(kMostFewer, options.rays_per_pixel / kFewestRays)),
      known_(past_ && most_fewer_ > 1 ? g.size() : 0)
{
    if (known_.empty()) return;
    const Seen seen{g, view, shading};
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            if (g.covered(i) && shading.is_traced(i)) known_[i] = find(seen, i);
    });
}

PastLobes::Known PastLobes::find(const Seen& seen, std::size_t i) const
{
    const PastPlace& place = past_->places[i];
    if (!place.is_seen() || looks_through(seen.shading.bsdf(seen.g, i))) return {};
    if (const int views = views_at(place, i); views > 1)
        return {place, static_cast<std::uint8_t>(std::min(most_fewer_, views))};
    const PastPlace image = image_of(seen, i);
    if (!image.is_seen() || views_at(image, std::nullopt) == 1) return {};
    return {image, static_cast<std::uint8_t>(most_fewer_)};
}

/// Views over which what shows at a place of the earlier view does so; 1: it is not even there.
/// @param pixel  whose lobes lag behind the viewer; none: they show an image
int PastLobes::views_at(const PastPlace& place, std::optional<std::size_t> pixel) const
{
    std::array<glm::vec3, 4> light{};
    float mean = 0.0f, variance = 0.0f;
    const std::array<std::size_t, 4> around = past_->places.around(place);
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t j = around[k];
        if (!(luminance(past_->light.reflectance[j]) > 0.0f)) return 1;  // nothing was traced there
        light[k] = past_->light.radiance[j];
        variance += 0.25f * past_->light.error[j] * past_->light.error[j];
        if (!past_->light.of_lamps.empty()) {
            light[k] += past_->light.of_lamps[j];
            variance += 0.25f * past_->light.of_lamps_error[j] * past_->light.of_lamps_error[j];
        }
        mean += 0.25f * luminance(light[k]);
    }
    const float all = past_->places.mean(past_->all, place);
    if (!is_even(light, std::sqrt(variance), all)) return 1;
    return pixel ? past_->places.views(*pixel, all > 0.0f ? kChange * mean / all : 0.0f) : kMostFewer;
}

/// Where the earlier view saw, in the plane of the point, the image that this view sees there.
PastPlace PastLobes::image_of(const Seen& seen, std::size_t i) const
{
    const PastPoints& past = past_->places.points();
    if (seen.view.camera.projection == Projection::orthographic) return {};
    const glm::dvec3 to_past = seen.g.camera_position - past.camera_position, relative(seen.g.position(i));
    const double far = kFar * glm::length(relative);
    const double distance = std::min(far, static_cast<double>(past_->light.distance[past_->places.nearest(i)]));
    const glm::dvec3 point = relative + to_past, image = point + distance * glm::normalize(relative);
    const PastPlace place = past_->places.project(image);
    if (!place.is_seen()) return {};
    for (const std::size_t before : past_->places.around(place))
        if (!shows_image(seen, i, glm::vec3(point), glm::vec3(image), before)) return {};
    return place;
}

/// Whether a pixel of the earlier view lies in the plane of this one's point, and lobes from there met what the image
/// is of. @param point, image  relative to the earlier camera
bool PastLobes::shows_image(const Seen& seen, std::size_t i, glm::vec3 point, glm::vec3 image, std::size_t before) const
{
    const PastPoints& past = past_->places.points();
    const glm::vec3 normal = seen.g.normal(i), there = past.position[before];
    if (past.instance[before] != seen.g.instance[i] || glm::length(past.normal[before] - normal) > kFlat) return false;
    if (std::abs(glm::dot(there - point, normal)) > kOffPlane * seen.g.footprint[i]) return false;
    // Where this view sees what shows there, if it lies as far behind the plane as it was met, or as the image does.
    const glm::dvec3 from(there), to_now = past.camera_position - seen.g.camera_position;
    const auto shown_at = [&](double distance) {
        return image_position(seen.view, from + distance * glm::normalize(from) + to_now);
    };
    const double behind = static_cast<double>(glm::length(image - there)), away = glm::length(from);
    const double met = std::min(kFar * away, static_cast<double>(past_->light.distance[before]));
    const std::optional<glm::dvec2> as_met = shown_at(met), as_image = shown_at(behind);
    const Bsdf bsdf = seen.shading.bsdf(seen.g, i);
    const double width = static_cast<double>(narrowest(bsdf, bsdf.those(lit_by_rays)));
    const double blur = width * behind / (behind + away) / image_plane(seen.view).pixel;
    return as_met && as_image && glm::length(*as_met - *as_image) <= kSamePixel + kOfBlur * blur;
}

void PastLobes::add_to(TracedLight& light) const
{
    if (known_.empty()) return;
    light.variance.assign(known_.size(), 1.0f);
    for (std::size_t i = 0; i < known_.size(); ++i) {
        if (known_[i].fewer == 1) continue;
        const PastPlace& place = known_[i].place;
        const auto now = static_cast<float>(known_[i].fewer);
        const float known = past_->light.variance.empty() ? 1.0f : past_->places.mean(past_->light.variance, place);
        const PastMix mix = mix_of(known, now, 1.0f / now);
        const float error = std::sqrt(mix.variance / now);
        const glm::vec3 reflectance = past_->places.mean(past_->light.reflectance, place);
        const auto add = [&](const std::vector<glm::vec3>& before, std::vector<glm::vec3>& radiance,
                             std::vector<float>& errors) {
            if (radiance.empty()) return;
            const glm::vec3 there = recoloured(past_->places.mean(before, place), light.reflectance[i], reflectance);
            radiance[i] = mix_with_past(there, radiance[i], mix.weight);
            errors[i] *= error;
        };
        add(past_->light.radiance, light.radiance, light.error);
        add(past_->light.of_lamps, light.of_lamps, light.of_lamps_error);
        light.variance[i] = mix.variance;
    }
}

}  // namespace rcs
