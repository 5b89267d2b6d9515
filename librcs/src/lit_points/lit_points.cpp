#include "lit_points/lit_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rays/shadow_batch.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr std::size_t kBatch = 256;  // places whose shadow rays are traced together

/// Light that comes to a place over a shadow ray.
struct Arrival {
    std::uint32_t place;
    glm::vec3 white;  // radiance of a white surface
    glm::vec3 to_light;
};

struct Reflection {
    glm::vec3 color{1.0f};  // of a plain surface's base
    Bsdf bsdf;              // of another surface; empty: plain
};

Reflection reflection_at(const HitRadiance& radiance, float least_alpha, const PlaceToLight& p)
{
    const float width = std::sqrt(p.area);
    if (radiance.is_plain(p.place.hit.instance))
        return {radiance.base_color({p.place.point.material, p.place.point.uv, p.place.uv_per_length, width}), {}};
    return {glm::vec3(1.0f), radiance
                                 .widened_values(p.place.hit, p.place.point, p.place.point.geometric_normal,
                                                 p.place.uv_per_length * width, least_alpha)
                                 .bsdf};
}

/// One direction for all that arrives at a place: of two, one by chance, in proportion to what they bring.
void keep_one(std::vector<Arrival>& arrivals, RandomStream& random)
{
    if (arrivals.size() < 2) return;
    float sum = 0.0f;
    for (const Arrival& a : arrivals) sum += luminance(a.white);
    float rest = random.next() * sum;
    std::size_t chosen = 0;
    while (chosen + 1 < arrivals.size() && (rest -= luminance(arrivals[chosen].white)) >= 0.0f) ++chosen;
    const float share = luminance(arrivals[chosen].white) / sum;
    arrivals = {{arrivals[chosen].place, arrivals[chosen].white / share, arrivals[chosen].to_light}};
}

void add_point(const PlaceToLight& p, const Reflection& reflection, const Arrival& arrival, LitPoints& out)
{
    const SurfacePoint& s = p.place.point;
    LitPoint point{s.position, 0.0f, s.geometric_normal, 0.0f};
    LitPointLight light{p.area * arrival.white, arrival.to_light, s.shading_normal,
                        s.position_error,       reflection.color, p.place.point.material,
                        LitPointLight::kPlain,  arrival.place,    0};
    glm::vec3 albedo = reflection.color;
    if (reflection.bsdf.count > 0) {
        albedo = total_albedo(reflection.bsdf, reflection.bsdf.normal);
        light.bsdf = static_cast<std::uint32_t>(out.bsdfs.size());
        light.normal = reflection.bsdf.normal;
        out.bsdfs.push_back(reflection.bsdf);
    }
    // Dark surfaces still have a layer that reflects a little.
    constexpr float kLeastAlbedo = 0.04f;
    point.power = luminance(glm::max(albedo, kLeastAlbedo) * light.radiance_area);
    if (!(point.power > 0.0f) || !std::isfinite(point.power)) return;
    out.points.push_back(point);
    out.lights.push_back(light);
}

/// Over their mean, so that no product of powers leaves a float's range, however dim or bright the lamps.
void make_relative(std::vector<LitPoint>& points)
{
    double sum = 0.0;
    for (const LitPoint& p : points) sum += static_cast<double>(p.power);
    const double scale = static_cast<double>(points.size()) / sum;
    for (LitPoint& p : points) p.power = static_cast<float>(scale * static_cast<double>(p.power));
}

void add_lamp_point(const PlaceLight& light, const PlaceToLight& p, std::uint32_t place, LitPoints& out)
{
    const SurfacePoint& s = p.place.point;
    const float width = p.place.uv_per_length * std::sqrt(p.area);
    const glm::vec3 radiance = light.radiance.emission(p.place.hit, s, s.geometric_normal, width);
    const float power = p.area * luminance(radiance);
    if (!(power > 0.0f) || !std::isfinite(power)) return;
    out.points.push_back({s.position, power, s.geometric_normal, 0.0f});
    LitPointLight& point = out.lights.emplace_back();
    point.radiance_area = p.area * radiance;
    point.position_error = s.position_error;
    point.bsdf = LitPointLight::kLamp;
    point.place = place;
    point.lamp = light.radiance.lamp_number(p.place.hit);
}

LitPoints light_batch(const PlaceLight& light, std::span<const PlaceToLight> places, std::uint64_t key)
{
    LitPoints lit;
    if (light.lamps) {
        for (std::size_t i = 0; i < places.size(); ++i)
            add_lamp_point(light, places[i], static_cast<std::uint32_t>(i), lit);
        return lit;
    }
    ShadowBatch shadow;
    std::vector<Arrival> wanted;
    std::vector<Reflection> reflections;
    for (std::size_t i = 0; i < places.size(); ++i) {
        reflections.push_back(reflection_at(light.radiance, light.least_alpha, places[i]));
        SurfacePoint bent = places[i].place.point;
        if (reflections.back().bsdf.count > 0) bent.shading_normal = reflections.back().bsdf.normal;
        RandomStream random(mix64(key + i));
        light.radiance.direct(bent, random, [&](const Ray& ray, glm::vec3 white) {
            shadow.add(ray);
            wanted.push_back({static_cast<std::uint32_t>(i), white, ray.direction});
        });
    }
    shadow.trace(light.rays);
    std::vector<Arrival> here;
    for (std::size_t i = 0, ray = 0; i < places.size(); ++i) {
        here.clear();
        for (; ray < wanted.size() && wanted[ray].place == i; ++ray) {
            if (!shadow.is_free(ray)) continue;
            wanted[ray].white *= shadow.transmittance(ray);
            if (luminance(wanted[ray].white) > 0.0f) here.push_back(wanted[ray]);
        }
        RandomStream random(mix64(~key + i));
        keep_one(here, random);
        if (!here.empty()) add_point(places[i], reflections[i], here.front(), lit);
    }
    return lit;
}

}  // namespace

glm::vec3 LitPoints::end_of_ray(std::size_t point, glm::vec3 from) const
{
    constexpr float kOfDistance = 0x1p-20f;
    const LitPoint& p = points[point];
    const float off = lights[point].position_error + kOfDistance * glm::distance(p.position, from);
    return p.position + off * p.normal;
}

glm::vec3 LitPoints::radiance_area(const HitRadiance& radiance, std::size_t point, glm::vec3 outgoing) const
{
    const LitPointLight& l = lights[point];
    if (l.bsdf == LitPointLight::kLamp) return l.radiance_area;
    if (l.bsdf == LitPointLight::kPlain)
        return l.radiance_area * radiance.reflectance(l.material, l.color, l.normal, outgoing, l.to_light);
    return l.radiance_area * std::numbers::pi_v<float> * evaluate(bsdfs[l.bsdf], outgoing, l.to_light);
}

ChangeAlong LitPoints::moving_of_radiance_area(std::size_t point, glm::vec3 outgoing, float distance,
                                               const Basis& frame) const
{
    const LitPointLight& l = lights[point];
    if (l.bsdf >= bsdfs.size()) return {};  // a lamp, or plain
    ChangeAlong moving = MovingViews(bsdfs[l.bsdf], outgoing, distance, frame).change(l.to_light);
    for (glm::vec3& along : moving) along *= l.radiance_area;
    return moving;
}

LitPoints light_places(const PlaceLight& light, std::span<const PlaceToLight> places, std::uint64_t key,
                       ThreadPool& pool)
{
    std::vector<LitPoints> parts((places.size() + kBatch - 1) / kBatch);
    pool.parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t b = begin; b < end; ++b)
            parts[b] = light_batch(light, places.subspan(b * kBatch, std::min(kBatch, places.size() - b * kBatch)),
                                   mix64(key ^ b));
    });
    LitPoints lit;
    for (const LitPoints& part : parts) {
        const std::uint32_t first = static_cast<std::uint32_t>(lit.bsdfs.size());
        const std::size_t first_place = static_cast<std::size_t>(&part - parts.data()) * kBatch;
        lit.points.insert(lit.points.end(), part.points.begin(), part.points.end());
        lit.bsdfs.insert(lit.bsdfs.end(), part.bsdfs.begin(), part.bsdfs.end());
        for (LitPointLight point : part.lights) {
            if (point.bsdf < LitPointLight::kLamp) point.bsdf += first;
            point.place += static_cast<std::uint32_t>(first_place);
            lit.lights.push_back(point);
        }
    }
    make_relative(lit.points);
    return lit;
}

}  // namespace rcs
