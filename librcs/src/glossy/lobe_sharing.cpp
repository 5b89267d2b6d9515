#include "glossy/lobe_sharing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "glossy/lobe_looks.h"
#include "glossy/lobe_reach.h"
#include "util/color.h"
#include "util/multiversion.h"
#include "util/random.h"

namespace rcs {

namespace {

constexpr int kNeighbours = 16;

/// Vogel's spiral: even over the unit disc.
const std::array<glm::vec2, kNeighbours>& spiral()
{
    static const std::array<glm::vec2, kNeighbours> places = [] {
        std::array<glm::vec2, kNeighbours> made;
        for (int n = 0; n < kNeighbours; ++n) {
            const float angle = 2.3999632f * static_cast<float>(n);
            made[static_cast<std::size_t>(n)] =
                std::sqrt((static_cast<float>(n) + 0.5f) / kNeighbours) * glm::vec2(std::cos(angle), std::sin(angle));
        }
        return made;
    }();
    return places;
}

/// Rays' light weighted by a lobe: the weighted mean, and how uncertain that is.
struct WeightedLight {
    glm::vec3 sum{0.0f}, total{0.0f};                              // of weight times radiance, and of weights
    float squares = 0.0f, products = 0.0f, square_weights = 0.0f;  // on luminance: (w L)^2, w L w, w^2

    void add(glm::vec3 weight, glm::vec3 radiance)
    {
        const float w = luminance(weight), l = luminance(weight * radiance);
        sum += weight * radiance;
        total += weight;
        squares += l * l;
        products += l * w;
        square_weights += w * w;
    }
    /// Of sum over total, a ratio of two means.
    float error_of_ratio() const
    {
        const float w = luminance(total);
        if (!(w > 0.0f)) return 0.0f;
        const float ratio = luminance(sum) / w;
        return std::sqrt(std::max(0.0f, squares - 2.0f * ratio * products + ratio * ratio * square_weights)) / w;
    }
    /// The mean, of a lobe that reflects so much.
    LobeLight by(glm::vec3 albedo) const
    {
        LobeLight reflected{glm::vec3(0.0f), luminance(albedo) * error_of_ratio()};
        for (int c = 0; c < 3; ++c) reflected.radiance[c] = total[c] > 0.0f ? albedo[c] * sum[c] / total[c] : 0.0f;
        return reflected;
    }
    float error_of_mean(float count) const
    {
        const float mean = luminance(sum) / count;
        return std::sqrt(std::max(0.0f, squares / count - mean * mean) / count);
    }
};

/// Rays or looks as they arrive at a pixel, some at a time.
struct ArrivingLanes {
    static constexpr std::size_t kWidth = DirectionLanes::kWidth;

    std::size_t count = 0;
    std::array<const LobeRay*, kWidth> ray;
    std::array<std::size_t, kWidth> of;  ///< whose it is
    DirectionLanes target;               ///< as of LobeRay; becomes the unit direction that it arrives from
    float distance[kWidth] = {};
    float spread[kWidth] = {};  ///< solid angle over that which it has where it starts
    ColorLanes scattered;       ///< f |cosine|

    void add(const LobeRay& one, std::size_t pixel)
    {
        ray[count] = &one;
        of[count] = pixel;
        target.set(count, one.target);
        distance[count++] = one.distance;
    }
};

/// @param position  of the pixel's point, relative to the camera
RCS_MULTIVERSION
void arrive(glm::vec3 position, ArrivingLanes& lanes)
{
    DirectionLanes& at = lanes.target;
    for (std::size_t i = 0; i < ArrivingLanes::kWidth; ++i) {
        const glm::vec3 way = at[i] - position;
        const float distance = lanes.distance[i], d2 = glm::dot(way, way), length = std::sqrt(d2);
        const bool is_near = distance <= std::numeric_limits<float>::max();
        at.x[i] = is_near ? way.x / length : at.x[i];
        at.y[i] = is_near ? way.y / length : at.y[i];
        at.z[i] = is_near ? way.z / length : at.z[i];
        lanes.spread[i] = is_near ? distance * distance / d2 : 1.0f;
    }
}

RCS_MULTIVERSION
void times_cosine(glm::vec3 normal, const DirectionLanes& incoming, ColorLanes& f)
{
    for (std::size_t i = 0; i < DirectionLanes::kWidth; ++i) {
        const float cosine = std::abs(glm::dot(normal, incoming[i]));
        f.r[i] *= cosine;
        f.g[i] *= cosine;
        f.b[i] *= cosine;
    }
}

/// Whether two rays hit one face, close together over how far they went.
bool hit_together(const RayRing& ring, const LobeRay& a, const LobeRay& b)
{
    constexpr float kSameNormal = 0.9f, kSamePlane = 0.1f, kClose = 0.1f;
    const SoftLight& at = ring.soft(a);
    if (!(b.density > 0.0f) || !(glm::dot(at.normal, ring.soft(b).normal) > kSameNormal)) return false;
    const glm::vec3 way = b.target - a.target;
    const float length = glm::length(way);
    return length < kClose * a.distance && std::abs(glm::dot(way, at.normal)) <= kSamePlane * length;
}

/// Soft light that a pixel's ray brings, as its own and its neighbours' rays of the same number received it where they
/// hit together: each of a pixel's rays stays independent of the others.
glm::vec3 shared_soft(const RayRing& ring, std::size_t pixel, const LobeRay& ray, std::span<const std::size_t> near)
{
    const SoftLight& own = ring.soft(ray);
    if (near.empty() || own.albedo == glm::vec3(0.0f)) return own.radiance;
    const auto received = [](const SoftLight& soft) {
        glm::vec3 light(0.0f);
        for (int c = 0; c < 3; ++c)
            if (soft.albedo[c] > 0.0f) light[c] = soft.radiance[c] / soft.albedo[c];
        return light;
    };
    const auto number = static_cast<std::size_t>(&ray - ring.of(pixel).data());
    glm::vec3 sum = received(own), count = glm::vec3(glm::greaterThan(own.albedo, glm::vec3(0.0f)));
    for (const std::size_t neighbour : near) {
        const LobeRay& other = ring.of(neighbour)[number];
        if (!hit_together(ring, ray, other)) continue;
        sum += received(ring.soft(other));
        count += glm::vec3(glm::greaterThan(ring.soft(other).albedo, glm::vec3(0.0f)));
    }
    return own.albedo * sum / glm::max(count, 1.0f);
}

/// Of pixels whose narrow lobes share soft light where they hit [px]: the fewer their rays, the farther.
float reach_of_hits(const RayRing& ring)
{
    // With 16 rays a mirror in a room with one window is off least at a reach of 2 px: at 1.5, 2, 3 and 4 by .27, .23,
    // .24 and .27 of its light (rms); by .56 if nothing is shared.
    constexpr float kRays = 64.0f;
    if (!ring.has_soft()) return 0.0f;
    return std::min(static_cast<float>(RayRing::kMostReach), std::sqrt(kRays / static_cast<float>(ring.count())));
}

/// What a pixel's lobes make of rays and looks, its own and others'.
class Receiver {
public:
    /// @param looked  whether looks will be added, if its lobes look   @param key  of the pixel's random numbers
    Receiver(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 position, const RayRing& ring, bool looked,
             std::uint64_t key)
        : bsdf_(bsdf),
          seen_(bsdf, outgoing, bsdf.those(lit_by_rays)),
          position_(position),
          whole_(albedo(bsdf, outgoing, bsdf.those(lit_by_rays))),
          above_(part_above_face(bsdf, outgoing, bsdf.those(lit_by_rays), key)),
          to_density_(std::numbers::pi_v<float> / std::max(luminance(whole_), 1e-30f)),
          looks_(looked && ring.has_looks() && LobeLooks::looks(bsdf, bsdf.those(lit_by_rays))),
          ring_(ring)
    {
    }

    /// @param near  pixels whose rays of the same number share soft light with these
    void add_rays(std::size_t of, std::span<const std::size_t> near = {})
    {
        for (const LobeRay& ray : ring_.of(of)) {
            if (!(ray.density > 0.0f)) continue;
            lanes_.add(ray, of);
            if (lanes_.count == ArrivingLanes::kWidth) receive_rays(near);
        }
        if (!near.empty()) receive_rays(near);
    }
    void add_looks(std::size_t of)
    {
        if (!looks_) return;
        if (looks_of_ == 0.0f) receive_rays({});
        looks_of_ += 1.0f;
        for (const LobeRay& look : ring_.looks_of(of)) {
            if (!(look.density > 0.0f) || ring_.lit(look).radiance == glm::vec3(0.0f)) continue;
            lanes_.add(look, of);
            if (lanes_.count == ArrivingLanes::kWidth) receive_looks();
        }
    }

    /// @param alone  of the pixel's own rays: their mean, else that over the mean of their weights
    LobeLights sum(bool alone)
    {
        if (looks_of_ > 0.0f)
            receive_looks();
        else
            receive_rays({});
        LobeLights lights{light_of(rays_, alone), light_of(of_lamps_, alone), 0.0f, above_ * whole_};
        if (!looks_) return lights;
        // Each pixel's looks add up to what rays leave to them.
        const auto looks = static_cast<float>(ring_.looks_of(0).size());
        lights.reflected.radiance += looked_.sum / looks_of_;
        lights.reflected.error = std::hypot(lights.reflected.error, looks * looked_.error_of_mean(looks * looks_of_));
        return lights;
    }

private:
    void receive()
    {
        arrive(position_, lanes_);
        lanes_.scattered = seen_.evaluate(lanes_.target);
        times_cosine(bsdf_.normal, lanes_.target, lanes_.scattered);
    }
    void receive_rays(std::span<const std::size_t> near)
    {
        if (lanes_.count == 0) return;
        receive();
        for (std::size_t i = 0; i < lanes_.count; ++i) {
            const LobeRay& ray = *lanes_.ray[i];
            const glm::vec3 scattered = lanes_.scattered[i];
            const glm::vec3 weight = scattered * (lanes_.spread[i] / ray.density);
            glm::vec3 radiance = ray.radiance;
            if (ring_.has_looks())
                radiance +=
                    (1.0f - part_of_looks(lanes_.spread[i], scattered, ring_.lit(ray))) * ring_.lit(ray).radiance;
            if (ring_.has_soft()) radiance += shared_soft(ring_, lanes_.of[i], ray, near);
            rays_.add(weight, radiance);
            if (ring_.finds_lamps()) of_lamps_.add(weight, ring_.of_lamps(ray));
        }
        lanes_.count = 0;
    }
    void receive_looks()
    {
        if (lanes_.count == 0) return;
        receive();
        for (std::size_t i = 0; i < lanes_.count; ++i) {
            const LobeRay& look = *lanes_.ray[i];
            const LitPart& lit = ring_.lit(look);
            const glm::vec3 scattered = lanes_.scattered[i];
            looked_.add(scattered * (lanes_.spread[i] / look.density),
                        part_of_looks(lanes_.spread[i], scattered, lit) * lit.radiance);
        }
        lanes_.count = 0;
    }
    float part_of_looks(float spread, glm::vec3 scattered, const LitPart& lit) const
    {
        if (!looks_ || !(lit.bound > 0.0f)) return 0.0f;
        const float bound = lit.bound / spread;
        return bound / (bound + to_density_ * luminance(scattered));
    }
    LobeLight light_of(const WeightedLight& found, bool alone) const
    {
        const auto count = static_cast<float>(ring_.count());
        return alone || looks_through(bsdf_) ? LobeLight{found.sum / count, found.error_of_mean(count)}
                                             : found.by(above_ * whole_);
    }

    const Bsdf& bsdf_;
    SeenLobes seen_;
    glm::vec3 position_, whole_;
    float above_;  // of that, what rays can bring
    float to_density_;
    bool looks_;
    const RayRing& ring_;
    WeightedLight rays_, of_lamps_, looked_;
    float looks_of_ = 0.0f;  // pixels
    ArrivingLanes lanes_;    // not yet received: rays, or looks once any were added
};

/// Harmonic mean of how long rays are [m].
float mean_distance(std::span<const LobeRay> rays)
{
    float inverse = 0.0f, count = 0.0f;
    for (const LobeRay& ray : rays) {
        if (!(ray.density > 0.0f)) continue;
        inverse += 1.0f / ray.distance;
        count += 1.0f;
    }
    return inverse > 0.0f ? count / inverse : std::numeric_limits<float>::infinity();
}

}  // namespace

/// The pixel, or one beside it that looked in its place.
std::size_t LobeSharing::looking_near(std::size_t pixel) const
{
    if (looked(pixel)) return pixel;
    const auto width = static_cast<std::size_t>(g_.width), height = static_cast<std::size_t>(g_.height);
    const std::size_t x = pixel % width, y = pixel / width;
    for (std::size_t row = y & ~std::size_t{1}; row < std::min((y | 1u) + 1, height); ++row)
        for (std::size_t column = x & ~std::size_t{1}; column < std::min((x | 1u) + 1, width); ++column)
            if (const std::size_t i = row * width + column; looked(i) && may_share(g_, shading_, pixel, i)) return i;
    return pixel;
}

LobeSharing::Reach LobeSharing::reach_of(std::size_t pixel, const Bsdf& bsdf, const RayRing& ring) const
{
    if (looks_through(bsdf)) return {};
    // Beyond the width of the lobe where it hits, a neighbour sees other things; and so it does where its normal turns
    // by more than that: what it is unlikely to find may be the middle of this pixel's lobe, and far too bright.
    const float alpha = shading_.traced[pixel], per_length = alpha / g_.footprint[pixel];
    const float most = most_reach(g_, shading_, pixel, alpha);
    const auto reach = [&](std::span<const LobeRay> rays) { return std::min(most, per_length * mean_distance(rays)); };
    const float rays = reach(ring.of(pixel));
    // Lit points are mostly farther off than what the lobe meets, which may stand in their way.
    return {rays,
            ring.has_looks() ? std::sqrt(std::max(1.0f, rays) * reach(ring.looks_of(looking_near(pixel)))) : 0.0f};
}

/// Calls visit(pixel) for pixels around one that lie on its surface.
template <typename Visit>
void LobeSharing::each_neighbour(std::size_t pixel, float reach, const Visit& visit) const
{
    if (reach < 1.0f) return;
    const int x = static_cast<int>(pixel % static_cast<std::size_t>(g_.width));
    const int y = static_cast<int>(pixel / static_cast<std::size_t>(g_.width));
    const float turn =
        2.0f * std::numbers::pi_v<float> *
        to_unit_float(static_cast<std::uint32_t>(mix64(lobe_key(settings_.seed, pixel_number(view_, pixel)) + 77)));
    const glm::vec2 along = reach * glm::vec2(std::cos(turn), std::sin(turn)), across(-along.y, along.x);
    for (const glm::vec2 place : spiral()) {
        const glm::vec2 step = glm::round(place.x * along + place.y * across);
        const int nx = x + static_cast<int>(step.x), ny = y + static_cast<int>(step.y);
        if (nx < 0 || ny < 0 || nx >= g_.width || ny >= g_.height || (nx == x && ny == y)) continue;
        const std::size_t neighbour =
            static_cast<std::size_t>(ny) * static_cast<std::size_t>(g_.width) + static_cast<std::size_t>(nx);
        if (settings_.takes(neighbour) && may_share(g_, shading_, pixel, neighbour)) visit(neighbour);
    }
}

LobeLights LobeSharing::share(std::size_t pixel, const RayRing& ring) const
{
    const Bsdf bsdf = shading_.bsdf(g_, pixel);
    const Reach reach = reach_of(pixel, bsdf, ring);
    std::array<std::size_t, kNeighbours + 1> looking;
    std::size_t count = 0;
    if (looked(pixel)) looking[count++] = pixel;
    each_neighbour(pixel, reach.looks, [&](std::size_t i) {
        if (looked(i)) looking[count++] = i;
    });
    Receiver receiver(bsdf, outgoing_at(g_, view_.camera, pixel), g_.position(pixel), ring, count > 0,
                      ~lobe_key(settings_.seed, pixel_number(view_, pixel)) + 1);
    std::vector<std::size_t> near;
    const float of_hits = reach_of_hits(ring);
    if (reach.rays < of_hits) each_neighbour(pixel, of_hits, [&](std::size_t i) { near.push_back(i); });
    receiver.add_rays(pixel, near);
    each_neighbour(pixel, reach.rays, [&](std::size_t i) { receiver.add_rays(i); });
    for (std::size_t k = 0; k < count; ++k) receiver.add_looks(looking[k]);
    LobeLights lights = receiver.sum(false);
    lights.distance = mean_distance(ring.of(pixel));
    lights.width = shading_.traced[pixel];
    return lights;
}

LobeLights LobeSharing::by_own(std::size_t pixel, const RayRing& ring) const
{
    const Bsdf bsdf = shading_.bsdf(g_, pixel);
    Receiver receiver(bsdf, outgoing_at(g_, view_.camera, pixel), g_.position(pixel), ring, true,
                      ~lobe_key(settings_.seed, pixel_number(view_, pixel)) + 1);
    receiver.add_rays(pixel);
    receiver.add_looks(pixel);
    return receiver.sum(true);
}

void LobeSharing::find_neighbours(std::size_t pixel, const RayRing& ring, std::vector<std::size_t>& pixels) const
{
    pixels.clear();
    const Reach reach = reach_of(pixel, shading_.bsdf(g_, pixel), ring);
    for (const float one : {reach.rays, reach.looks})
        each_neighbour(pixel, one, [&](std::size_t i) { pixels.push_back(i); });
}

}  // namespace rcs
