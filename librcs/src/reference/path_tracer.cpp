#include "reference/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "material/material_lobes.h"
#include "reference/passage.h"
#include "util/basis.h"
#include "util/color.h"

namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

// What each pair of a path's points is for, at each of its points: a lamp, a direction, a lobe and what the ray goes
// through, a place in the sky. The choice of a layer comes before all.
constexpr int kLayerPair = kPixelPair + 1;
constexpr int lamp_pair(int bounce) { return kPixelPair + 2 + 4 * bounce; }
constexpr int direction_pair(int bounce) { return lamp_pair(bounce) + 1; }
constexpr int choice_pair(int bounce) { return lamp_pair(bounce) + 2; }
constexpr int sky_pair(int bounce) { return lamp_pair(bounce) + 3; }

// So many surfaces behind each other the camera looks through; what is left of the light behind is below 1 % of a
// stack of half-transparent ones.
constexpr std::size_t kMostLayers = 32;

// Of a vertex's lamp samples, where both sides have some.
constexpr float kShareOfSide = 0.5f;

bool is_glossy(const Bsdf& bsdf) { return glossy_lobes(bsdf) != 0u; }

/// Weight of a sample taken with density p where another technique has density q.
float power_heuristic(float p, float q)
{
    const float ratio = q / p;
    return 1.0f / (1.0f + ratio * ratio);
}

/// What goes straight on through a surface is no matter of its BSDF here.
Bsdf scattering_part(const Bsdf& bsdf) { return bsdf.only(~bsdf.those(passes_rays)); }

/// The camera sees frosted panes as they are.
Bsdf seen_by_camera(const Bsdf& bsdf) { return bsdf.only(~bsdf.those(shows_straight)); }

/// The same as sample() for a Lambertian surface, quicker.
BsdfSample sample_lambertian(const SurfacePoint& point, glm::vec3 albedo, glm::vec2 u)
{
    BsdfSample s;
    s.incoming = cosine_direction(point.shading_normal, u);
    const float cosine = receiving_cosine(point, s.incoming);
    s.density = kInversePi * cosine;
    if (cosine > 0.0f) s.weight = albedo;
    return s;
}

/// f x cosine; of what is transmitted too.
glm::vec3 reflectance(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming)
{
    return evaluate(bsdf, outgoing, incoming) * std::abs(glm::dot(bsdf.normal, incoming));
}

}  // namespace

/// A point of a path, and what the path brings to the pixel from there.
struct PathTracer::Vertex {
    SurfacePoint point;
    Bsdf bsdf;
    glm::vec3 outgoing;
    glm::vec3 throughput{1.0f};
    int bounce = 0;
    LampsAtPoint behind;  ///< lamps of the other side, where light from there counts; else empty

    bool is_lit_behind() const { return !behind.cumulative.empty(); }
    bool is_first() const { return bounce == 0; }
};

PathTracer::PathTracer(const RayScene& rays, const View& view, const ReferenceOptions& options)
    : rays_(rays),
      camera_position_(camera_position(view.camera)),
      texture_scale_(1.0f / std::sqrt(static_cast<float>(options.aa))),
      bounces_(options.bounces),
      lamps_(list_lamps(rays)),
      sky_(rays.scene()),
      has_sky_(!sky_.is_black())
{
}

glm::vec3 PathTracer::exact_direct(const VisiblePoint& visible, glm::vec3 outgoing, Lamps which) const
{
    glm::vec3 sum(0.0f);
    const Bsdf bsdf = seen_by_camera(visible.material.bsdf);
    for (const PunctualLamp& light : lamps_.punctual) {
        const PunctualSample lamp = sample_punctual(light, visible.surface.position);
        if (which == Lamps::all && receiving_cosine(visible.surface, lamp.to_light) > 0.0f) continue;
        const glm::vec3 reflected = lamp.irradiance * reflectance(bsdf, outgoing, lamp.to_light);
        if (reflected != glm::vec3(0.0f))
            sum += reflected * transmitted_along(rays_, ray_from(visible.surface, lamp.to_light, lamp.distance));
    }
    return sum;
}

void PathTracer::add_layer(const Hit& hit, const CameraRay& camera, Lamps which, glm::vec3 weight, Seen& seen) const
{
    if (seen.layers.size() == seen.count) seen.layers.emplace_back();
    SeenLayer& layer = seen.layers[seen.count++];
    layer.point = visible_point(rays_, hit.instance, hit.primitive, camera, camera_position_, texture_scale_);
    layer.point.surface.shading_normal = layer.point.material.bsdf.normal;
    layer.weight = weight * layer.point.material.alpha;
    seen.emission += layer.weight * layer.point.emission;
    weigh_lamps(lamps_, layer.point.surface, which, layer.lamps);
    weigh_behind(layer.point.surface, layer.point.material.bsdf, Lamps::with_area, layer.behind);
    const bool needs_exact =
        which == Lamps::with_area || transmitting_lobes(seen_by_camera(layer.point.material.bsdf)) != 0u;
    layer.exact_direct = needs_exact ? exact_direct(layer.point, seen.outgoing, which) : glm::vec3(0.0f);
}

void PathTracer::look(const CameraRay& camera, Lamps which, Seen& seen) const
{
    seen.count = 0;
    seen.emission = glm::vec3(0.0f);
    seen.outgoing = -glm::vec3(glm::normalize(camera.direction));
    glm::vec3 weight(1.0f);
    std::optional<Hit> hit = find_visible(rays_, camera);
    while (hit && seen.count < kMostLayers) {
        add_layer(*hit, camera, which, weight, seen);
        const VisiblePoint& point = seen.layers[seen.count - 1].point;
        const Bsdf& bsdf = point.material.bsdf;
        const glm::vec3 through = albedo(bsdf, seen.outgoing, bsdf.those(shows_straight));
        weight *= (1.0f - point.material.alpha) + point.material.alpha * through;
        if (weight == glm::vec3(0.0f)) break;
        hit = find_visible(rays_, camera, hit->t);
    }
    if (!hit) seen.emission += weight * sky_.radiance(-seen.outgoing);

    float total = 0.0f;
    for (std::size_t i = 0; i < seen.count; ++i) total += largest(seen.layers[i].weight);
    float below = 0.0f;
    for (std::size_t i = 0; i < seen.count; ++i) {
        seen.layers[i].chance_below = total > 0.0f ? below / total : 0.0f;
        below += largest(seen.layers[i].weight);
    }
}

PathResult PathTracer::trace(const Seen& seen, const PathPoints& points, LampsAtPoint& scratch) const
{
    PathResult result{.emission = seen.emission};
    if (seen.count == 0) return result;
    std::size_t chosen = 0;
    float chance = 1.0f;
    if (seen.count > 1) {
        const float u = points.pair(kLayerPair).x;
        while (chosen + 1 < seen.count && seen.layers[chosen + 1].chance_below <= u) ++chosen;
        const float end = chosen + 1 < seen.count ? seen.layers[chosen + 1].chance_below : 1.0f;
        chance = end - seen.layers[chosen].chance_below;
    }
    const SeenLayer& layer = seen.layers[chosen];
    if (layer.weight == glm::vec3(0.0f)) return result;
    Vertex vertex{.point = layer.point.surface,
                  .bsdf = seen_by_camera(layer.point.material.bsdf),
                  .outgoing = seen.outgoing,
                  .throughput = layer.weight / chance,
                  .behind = layer.behind};
    result.direct = vertex.throughput * (layer.exact_direct + lamp_light(vertex, layer.lamps, points));
    add_sky(vertex, points, result);
    if (is_glossy(vertex.bsdf)) scratch = layer.lamps;  // asked again where the path finds a lamp
    while (extend(vertex, scratch, points, result)) {
    }
    return result;
}

/// The lamps that light the other side of a surface through which light comes evenly.
void PathTracer::weigh_behind(const SurfacePoint& point, const Bsdf& bsdf, Lamps which, LampsAtPoint& lamps) const
{
    lamps.cumulative.clear();
    if (bsdf.those(is_diffuse_behind) != 0u) weigh_lamps(lamps_, other_side(point), which, lamps);
}

/// Light of one sampled lamp, scattered. Where lamps of both sides count, each side has half of the samples.
glm::vec3 PathTracer::lamp_light(const Vertex& v, const LampsAtPoint& lamps, const PathPoints& points) const
{
    glm::vec2 u = points.pair(lamp_pair(v.bounce));
    const bool behind = v.is_lit_behind() && u.x >= 0.5f;
    const float share = v.is_lit_behind() ? kShareOfSide : 1.0f;
    if (v.is_lit_behind()) u.x = std::min(2.0f * u.x - (behind ? 1.0f : 0.0f), 0x1.fffffep-1f);
    const LampsAtPoint& of_side = behind ? v.behind : lamps;
    if (of_side.cumulative.empty()) return glm::vec3(0.0f);
    const LampSample lamp = sample_lamp(rays_, lamps_, behind ? other_side(v.point) : v.point, of_side, u);
    if (lamp.light == glm::vec3(0.0f)) return glm::vec3(0.0f);
    glm::vec3 light = lamp.light * reflectance(v.bsdf, v.outgoing, lamp.direction) / share;
    if (lamp.density > 0.0f && is_glossy(v.bsdf))
        light *= power_heuristic(share * lamp.density, density(v.bsdf, v.outgoing, lamp.direction));
    return light;
}

/// Light of a place in the environment image. A constant sky is left to where paths go on.
void PathTracer::add_sky(const Vertex& v, const PathPoints& points, PathResult& result) const
{
    if (!sky_.has_image()) return;
    const auto s = sky_.sample(points.pair(sky_pair(v.bounce)));
    if (!(s.density > 0.0f)) return;
    const glm::vec3 reflected = v.throughput * reflectance(v.bsdf, v.outgoing, s.direction);
    if (reflected == glm::vec3(0.0f)) return;
    const float w = power_heuristic(s.density, density(v.bsdf, v.outgoing, s.direction)) / s.density;
    const glm::vec3 arriving = w * reflected * transmitted_along(rays_, ray_from(v.point, s.direction));
    const glm::vec3 peak = v.is_first() ? sky_.peak(s.direction) : glm::vec3(0.0f);
    result.direct += arriving * peak;
    result.indirect += arriving * (s.radiance - peak);
}

/// Follows the path to its next point. @return whether there is one
bool PathTracer::extend(Vertex& v, LampsAtPoint& lamps, const PathPoints& points, PathResult& result) const
{
    const bool glossy = is_glossy(v.bsdf);
    const bool finds_lamps = glossy && !lamps_.triangles.empty();
    const bool is_last = v.bounce == bounces_;
    if (is_last && !has_sky_ && !finds_lamps) return false;

    const glm::vec2 choice = glossy || rays_.has_transparency() ? points.pair(choice_pair(v.bounce)) : glm::vec2(0.0f);
    const glm::vec2 u = points.pair(direction_pair(v.bounce));
    const BsdfSample s = glossy ? sample(v.bsdf, v.outgoing, choice.x, u)
                                : sample_lambertian(v.point, albedo(v.bsdf, v.outgoing, kAllLobes), u);
    if (s.weight == glm::vec3(0.0f)) return false;
    const glm::vec3 arriving = v.throughput * s.weight;
    const Ray ray = ray_from(v.point, s.incoming);
    const auto add_sky_light = [&](glm::vec3 weight) {
        if (sky_.has_image()) weight *= power_heuristic(s.density, sky_.density(s.incoming));
        const glm::vec3 peak = v.is_first() ? sky_.peak(s.incoming) : glm::vec3(0.0f);
        result.direct += weight * peak;
        result.indirect += weight * (sky_.radiance(s.incoming) - peak);
    };
    if (is_last && !finds_lamps) {
        const glm::vec3 seen = transmitted_along(rays_, ray);
        if (seen != glm::vec3(0.0f)) add_sky_light(arriving * seen);
        return false;
    }
    const Meeting meeting = next_surface(rays_, ray, choice.y);
    v.throughput = arriving * meeting.weight;
    if (!meeting.hit) {
        if (has_sky_) add_sky_light(v.throughput);
        return false;
    }
    if (finds_lamps && !lamps_.triangle_of[meeting.hit->instance].empty()) {
        const Hit& hit = *meeting.hit;
        const SurfacePoint lamp = surface_at(rays_, hit.instance, hit.primitive, hit.u, hit.v, s.incoming);
        const glm::vec3 emission = material_at(rays_, hit, lamp, -s.incoming, {}).emission;
        // Lamps behind a frosted pane are found in this way alone.
        float other = 0.0f;
        if (receiving_cosine(v.point, s.incoming) > 0.0f)
            other = lamp_density(lamps_, lamps, v.point, hit, s.incoming);
        else if (v.is_lit_behind())
            other = lamp_density(lamps_, v.behind, other_side(v.point), hit, s.incoming);
        if (v.is_lit_behind()) other *= kShareOfSide;
        const glm::vec3 light = v.throughput * emission * power_heuristic(s.density, other);
        (v.is_first() ? result.direct : result.indirect) += light;
    }
    return !is_last && arrive(v, *meeting.hit, s.incoming, lamps, points, result);
}

/// Moves the vertex to a hit and adds the light of lamps and sky that is reflected there.
bool PathTracer::arrive(Vertex& v, const Hit& hit, glm::vec3 direction, LampsAtPoint& lamps, const PathPoints& points,
                        PathResult& result) const
{
    ++v.bounce;
    v.behind.cumulative.clear();
    v.outgoing = -direction;
    v.point = surface_at(rays_, hit.instance, hit.primitive, hit.u, hit.v, direction);
    const Material& material = rays_.scene().materials[static_cast<std::size_t>(v.point.material)];
    // A texel costs as much as a short ray, and most points at the end of a path lie in shadow: a plain surface is
    // asked for its colour only if it is lit.
    if (is_lambertian(material) && !material.normal_texture.used()) {
        weigh_lamps(lamps_, v.point, Lamps::all, lamps);
        LampSample lamp;
        if (!lamps.cumulative.empty())
            lamp = sample_lamp(rays_, lamps_, v.point, lamps, points.pair(lamp_pair(v.bounce)));
        if (v.bounce == bounces_ && !has_sky_ && lamp.light == glm::vec3(0.0f)) return false;
        v.bsdf = material_at(rays_, hit, v.point, v.outgoing, {}).bsdf;
        result.indirect += v.throughput * albedo(v.bsdf, v.outgoing, kAllLobes) * kInversePi * lamp.light *
                           receiving_cosine(v.point, lamp.direction);
    } else {
        v.bsdf = scattering_part(material_at(rays_, hit, v.point, v.outgoing, {}).bsdf);
        v.point.shading_normal = v.bsdf.normal;
        weigh_lamps(lamps_, v.point, Lamps::all, lamps);
        weigh_behind(v.point, v.bsdf, Lamps::all, v.behind);
        result.indirect += v.throughput * lamp_light(v, lamps, points);
    }
    add_sky(v, points, result);
    return true;
}

}  // namespace rcs
