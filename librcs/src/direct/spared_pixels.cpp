#include "direct/spared_pixels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gbuffer/visible_points.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

// Albedo at least by which light is judged.
constexpr float kGrey = 0.2f;

/// The light of four pixels, as it reaches the viewer.
struct FourLit {
    std::array<glm::vec3, 4> diffuse{}, glossy{};
    float diffuse_variance = 0.0f, glossy_variance = 0.0f;  // of the luminance of one, in the mean
    bool is_exact = true;                                   // the diffuse part has no noise
    float mean = 0.0f, of_lobes = 0.0f;                     // luminance; of all, and of the glossy part
};

/// @param reflected  of irradiance
FourLit lit_before(const DirectLightResult& light, const std::array<std::size_t, 4>& pixels, glm::vec3 reflected)
{
    FourLit lit;
    const auto variance = [](const std::vector<float>& errors, float scale, std::size_t j) {
        return errors.empty() ? 0.0f : scale * scale * errors[j] * errors[j];
    };
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t j = pixels[k];
        lit.diffuse[k] = reflected * light.irradiance[j];
        lit.diffuse_variance += 0.25f * variance(light.irradiance_error, luminance(reflected), j);
        lit.is_exact = lit.is_exact && light.in_part[j] == 0;
        if (!light.glossy.empty()) lit.glossy[k] = light.glossy[j];
        lit.glossy_variance += 0.25f * variance(light.glossy_error, 1.0f, j);
        lit.of_lobes += 0.25f * luminance(lit.glossy[k]);
        lit.mean += 0.25f * luminance(lit.diffuse[k] + lit.glossy[k]);
    }
    return lit;
}

}  // namespace

SparedPixels::SparedPixels(const PastDirect* past, const DirectLight& light, const GBuffer& g, const View& view,
                           ThreadPool& pool, std::vector<DirectLight::Workspace>& workspaces)
    : past_(past), view_(view), how_(g.size(), How::sampled)
{
    if (!past) return;
    if (light.knows_by_shape() && !past->light.sight.empty()) by_shape_.resize(g.size());
    const Movers movers = light.movers(past->moved);
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int thread) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!g.covered(i) || !(past->is_still || past->places[i].is_seen()) || movers.touch(g.scene_position(i)))
                continue;
            how_[i] =
                past->is_still ? find_again(g, i) : find(light, g, i, workspaces[static_cast<std::size_t>(thread)]);
        }
    });
    if (past->is_still) sample_around(g, pool);
}

/// Of a view that is the one before: pixels are what they were if those are that tell of half-shadows there.
void SparedPixels::sample_around(const GBuffer& g, ThreadPool& pool)
{
    const std::vector<How> alone = how_;
    pool.parallel_for(g.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin; i < end; ++i)
            each_near(g, i, [&](std::size_t near) {
                const bool is_sampled = g.covered(near) && alone[near] == How::sampled;
                if (is_sampled || past_->places.points().instance[near] != g.instance[near]) how_[i] = How::sampled;
            });
    });
}

/// Of a view that is the one before.
SparedPixels::How SparedPixels::find_again(const GBuffer& g, std::size_t i) const
{
    const PastPoints& points = past_->places.points();
    const bool is_same = points.instance[i] == g.instance[i] && points.position[i] == g.position(i) &&
                         points.normal[i] == g.normal(i) && points.camera_position == g.camera_position;
    return is_same ? How::as_it_was : How::sampled;
}

SparedPixels::How SparedPixels::find(const DirectLight& light, const GBuffer& g, std::size_t i,
                                     DirectLight::Workspace& w)
{
    // Beside edges shadows are steep: of sibenik's direct light 1.6 and 2.3 % would be off there, .8 by samples, were
    // it that of 2 and 4 views.
    if (!past_->places[i].is_whole) return How::sampled;
    const std::array<std::size_t, 4> around = past_->places.around(i);
    // What black surfaces receive, others show.
    const glm::vec3 reflected = std::numbers::inv_pi_v<float> * glm::max(g.albedo[i], kGrey);
    const FourLit lit = lit_before(past_->light, around, reflected);
    const float all = past_->places.mean(past_->all, i);
    const int views = past_->places.views(i, all > 0.0f ? lit.of_lobes / all : 0.0f);
    const std::uint64_t turn = mix64(pixel_number(view_, i)) + past_->turn;
    if (turn % static_cast<std::uint64_t>(views) == 0) return How::sampled;
    const auto lobes_are_even = [&](float light_of_lamps) {
        return is_even(lit.glossy, std::sqrt(lit.glossy_variance), light_of_lamps + past_->little);
    };
    if (const std::optional<glm::vec3> known = lit.is_exact ? by_shape(light, g, i, around, w) : std::nullopt) {
        by_shape_[i] = *known;
        return lobes_are_even(luminance(reflected * *known) + lit.of_lobes) ? How::by_shape : How::sampled;
    }
    if (!lobes_are_even(lit.mean)) return How::sampled;
    const float beside = lit.mean + past_->little;
    const bool is_known = lit.is_exact ? is_exactly_even(lit.diffuse, beside)
                                       : is_even(lit.diffuse, std::sqrt(lit.diffuse_variance), beside);
    return is_known ? How::mean : How::sampled;
}

/// Irradiance, if the four agree on what they see of the lamps.
std::optional<glm::vec3> SparedPixels::by_shape(const DirectLight& light, const GBuffer& g, std::size_t i,
                                                const std::array<std::size_t, 4>& around,
                                                DirectLight::Workspace& w) const
{
    if (by_shape_.empty()) return std::nullopt;
    LampSight sight;
    for (const std::size_t j : around) {
        sight.free |= past_->light.sight[j].free;
        sight.hidden |= past_->light.sight[j].hidden;
    }
    return light.irradiance_of_seen(visible_point(g, i), sight, w);
}

/// The pixel of before whose sight of the lamps a pixel takes on.
std::size_t SparedPixels::handed_on(std::size_t pixel) const
{
    if (how_[pixel] == How::as_it_was) return pixel;
    return past_->places.drawn(pixel, mix64(mix64(pixel_number(view_, pixel)) + past_->number));
}

std::vector<std::uint8_t> SparedPixels::all() const
{
    std::vector<std::uint8_t> spared(how_.size());
    for (std::size_t i = 0; i < how_.size(); ++i) spared[i] = has(i) ? 1 : 0;
    return spared;
}

std::vector<LampSight> SparedPixels::sight() const
{
    std::vector<LampSight> known(how_.size());
    for (std::size_t i = 0; i < how_.size(); ++i)
        if (has(i)) known[i] = past_->light.sight[handed_on(i)];
    return known;
}

void SparedPixels::add_to(DirectLightResult& light) const
{
    for (std::size_t i = 0; i < how_.size(); ++i) {
        if (!has(i)) continue;
        const auto known = [&](const std::vector<glm::vec3>& before) {
            return how_[i] == How::as_it_was ? before[i] : past_->places.mean(before, i);
        };
        light.irradiance[i] = how_[i] == How::by_shape ? by_shape_[i] : known(past_->light.irradiance);
        if (!light.glossy.empty()) light.glossy[i] = known(past_->light.glossy);
        light.in_part[i] = past_->light.in_part[handed_on(i)];
    }
}

}  // namespace rcs
