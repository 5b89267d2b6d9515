#include "glossy/lobe_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "hit_light/hit_lobes.h"
#include "lamps/power_heuristic.h"
#include "rays/hit_surface.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kWidth = RayPacket::kWidth;

/// Points of a lattice in three dimensions (Roberts 2018), shifted at random per pixel.
glm::vec3 lattice_point(int n, glm::vec3 shift)
{
    const glm::vec3 p = shift + static_cast<float>(n) * glm::vec3(0.8191725f, 0.6710436f, 0.5497005f);
    return p - glm::floor(p);
}

}  // namespace

void LobePaths::begin_paths(std::size_t pixel, RayRing& ring, Workspace& w) const
{
    const Bsdf bsdf = shading_.bsdf(g_, pixel);
    const LobeSet traced = bsdf.those(lit_by_rays);
    const glm::vec3 outgoing = outgoing_at(g_, view_.camera, pixel);
    const std::uint64_t key = lobe_key(settings_.seed, pixel_number(view_, pixel));
    RandomStream random(key);
    const glm::vec3 shift(random.next(), random.next(), random.next());
    const std::span<LobeRay> own = ring.of(pixel);
    std::fill(own.begin(), own.end(), LobeRay{});
    const bool looks = looks_ && LobeLooks::looks(bsdf, traced);
    const SeenLobes seen(bsdf, outgoing, traced);
    const std::size_t rays = past_ ? past_->rays(pixel, ring.count()) : ring.count();
    for (std::size_t n = 0; n < rays; ++n) {
        const glm::vec3 point = lattice_point(static_cast<int>(n), shift);
        const BsdfSample sample = seen.sample(point.x, {point.y, point.z});
        if (!(sample.density > 0.0f) || sample.weight == glm::vec3(0.0f)) continue;
        own[n].density = sample.density;
        const bool outwards = glm::dot(sample.incoming, g_.geometric_normal[pixel]) >= 0.0f;
        LobePath path;
        path.ray.origin = g_.scene_position(pixel) + (outwards ? g_.position_error[pixel] : -g_.position_error[pixel]) *
                                                         g_.geometric_normal[pixel];
        path.ray.direction = sample.incoming;
        path.first = &own[n];
        if (ring.finds_lamps()) *(path.of_lamps = &ring.of_lamps(own[n])) = glm::vec3(0.0f);
        path.pixel = pixel;
        // The direct light knows what is reflected, and what comes through evenly.
        if (glm::dot(bsdf.normal, sample.incoming) < 0.0f && lobes_lit_behind(bsdf) == 0u)
            path.density = std::numeric_limits<float>::infinity();
        path.width = sample.alpha;
        if (sample.alpha > 2.0f * kLeastAlpha)
            path.spread = 1.0f / std::sqrt(std::max(sample.density, 1e-4f) * static_cast<float>(rays));
        if (ring.has_looks()) ring.lit(own[n]) = {};
        if (looks) path.lit = &ring.lit(own[n]);
        if (ring.has_soft()) ring.soft(own[n]) = {};
        if (ring.has_soft() && !looks) path.soft = &ring.soft(own[n]);
        path.key = mix64(key + 2 * n + 1);
        w.paths.push_back(path);
    }
}

/// Whether what shines there is a lamp whose light the direct light leaves to the visible point's own rays.
bool LobePaths::is_of_gathered(const LobePath& path, int lane, const Workspace& w) const
{
    return path.of_lamps && path.met == 0 && path.density == 0.0f && settings_.gathered->has(w.packet.instance(lane));
}

/// Where light goes that a plain surface reflects from lamps and sky.
glm::vec3& LobePaths::sum_of_plain(const LobePath& path, int lane, const HitSurface& hit, const Workspace& w) const
{
    if (path.met > 0 || !path.lit) return path.first->radiance;
    path.lit->bound = looks_->bound(w.packet, lane, hit);
    return path.lit->radiance;
}

void LobePaths::add_emission(const LobePath& path, int lane, const HitSurface& hit, glm::vec3 throughput,
                             float cone_width, const Workspace& w) const
{
    const glm::vec3 emission = light_.emission(w.packet, lane, hit, cone_width);
    if (emission == glm::vec3(0.0f)) return;
    const float others = path.met > 0 ? light_.density_of_lamp(path.from, w.packet, lane) : 0.0f;
    path.first->radiance += throughput * emission * path.of_lights * power_heuristic(path.density, others);
}

void LobePaths::add_sky(const LobePath& path, glm::vec3 throughput) const
{
    const Environment& sky = light_.environment();
    const glm::vec3 direction = path.ray.direction;
    const float soft = path.met > 0 ? power_heuristic(path.density, light_.density_of_sky(path.from, direction)) : 1.0f;
    const float peak = path.met > 0 ? power_heuristic(path.density, light_.density_of_peaks(path.from, direction))
                                    : power_heuristic(path.density, 0.0f);
    path.first->radiance += throughput * path.of_lights * (soft * sky.soft(direction) + peak * sky.peak(direction));
}

/// Of lamps and sky at a hit, where the lobe is wide enough to hide the edges of cells; null: shadow rays find it.
/// @param distance  from where the ray starts
const DirectCells::Light* LobePaths::known_light(const LobePath& path, const SurfacePoint& hit, float distance,
                                                 RandomStream& random) const
{
    const DirectCells* const cells = settings_.direct;
    if (!cells || !cells->serves(hit.position, distance)) return nullptr;
    const float width = path.width * (path.length + distance);
    if (width < cells->grid.edge(cells->grid.level(hit.position))) return nullptr;
    return cells->at(hit.position, hit.shading_normal, random);
}

void LobePaths::add_over(const Ray& shadow_ray, glm::vec3 radiance, glm::vec3& sum, Workspace& w)
{
    if (radiance == glm::vec3(0.0f)) return;
    w.shadow.add(shadow_ray);
    w.lights.push_back({&sum, radiance});
}

void LobePaths::shade_plain(const LobePath& path, int lane, const HitSurface& hit, glm::vec3 throughput,
                            RandomStream& random, Workspace& w) const
{
    const glm::vec3 outgoing = -ray_direction(w.packet.ray, lane);
    const float length = path.length + w.packet.ray.t_max[lane];
    const HitRadiance::PlainHit plain{hit.point.material, hit.point.uv, hit.uv_per_length, path.spread * length};
    const glm::vec3 albedo = light_.albedo(plain, glm::dot(hit.point.shading_normal, outgoing));
    const auto reflectance = [&](glm::vec3 to_light) {
        return light_.reflectance(plain, hit.point.shading_normal, outgoing, to_light);
    };
    glm::vec3& sum = sum_of_plain(path, lane, hit, w);
    if (const DirectCells::Light* const known = known_light(path, hit.point, w.packet.ray.t_max[lane], random)) {
        if (known->to_light != glm::vec3(0.0f))
            sum += throughput * std::numbers::inv_pi_v<float> * known->irradiance * reflectance(known->to_light);
    } else {
        SoftLight* const apart = path.met == 0 ? path.soft : nullptr;
        if (apart) *apart = {glm::vec3(0.0f), albedo, hit.point.geometric_normal};
        light_.each_light(hit.point, random, [&](const Ray& shadow_ray, glm::vec3 white, const auto&, bool soft) {
            add_over(shadow_ray, throughput * white * reflectance(shadow_ray.direction),
                     soft && apart ? apart->radiance : sum, w);
        });
    }
    path.first->radiance +=
        throughput * albedo * std::numbers::inv_pi_v<float> * light_.indirect_irradiance(hit.point, random, path.met);
}

void LobePaths::shade(const LobePath& path, int lane, const HitSurface& hit, glm::vec3 throughput, Workspace& w) const
{
    const RayPacket& p = w.packet.ray;
    const glm::vec3 outgoing = -ray_direction(p, lane);
    const float length = path.length + p.t_max[lane];
    const float cone_width = path.spread * length;
    if (is_of_gathered(path, lane, w))
        *path.of_lamps += throughput * light_.emission(w.packet, lane, hit, cone_width);
    else if (path.density > 0.0f)
        add_emission(path, lane, hit, throughput, cone_width, w);
    if (path.met == settings_.bounces) return;
    RandomStream random(path.key);
    const auto add = [&](const Ray& shadow_ray, glm::vec3 radiance) {
        add_over(shadow_ray, throughput * radiance, path.first->radiance, w);
    };
    const auto add_cached = [&](glm::vec3 albedo, const SurfacePoint& point) {
        path.first->radiance +=
            throughput * albedo * std::numbers::inv_pi_v<float> * light_.indirect_irradiance(point, random, path.met);
    };
    if (light_.is_plain(w.packet.instance(lane))) {
        shade_plain(path, lane, hit, throughput, random, w);
        return;
    }
    const MaterialValues surface = light_.values(w.packet, lane, hit, cone_width);
    const Bsdf& bsdf = surface.bsdf;
    const HitLobes lobes(bsdf, outgoing, path.width, is_curved(rays_, w.packet, lane));
    SurfacePoint bent = hit.point;
    bent.shading_normal = bsdf.normal;
    light_.each_light(bent, random, [&](const Ray& shadow_ray, glm::vec3 white, const auto& density, bool) {
        add(shadow_ray, std::numbers::pi_v<float> * lobes.evaluate(shadow_ray.direction, density()) * white);
    });
    add_cached(lobes.albedo(), hit.point);
    if (const LobeSet behind = bsdf.those(is_diffuse_behind)) {
        const glm::vec3 through = albedo(bsdf, outgoing, behind);
        const SurfacePoint back = other_side(bent);
        light_.direct(back, random, [&](const Ray& shadow_ray, glm::vec3 white) { add(shadow_ray, through * white); });
        add_cached(through, back);
    }
    go_on(path, bent, lobes, throughput, length, random, w);
}

void LobePaths::go_on(const LobePath& path, const SurfacePoint& point, const HitLobes& lobes, glm::vec3 throughput,
                      float length, RandomStream& random, Workspace& w) const
{
    const HitLobes::Onward onward = lobes.sample(throughput, path.met + 1 == settings_.bounces, random);
    if (onward.weight == glm::vec3(0.0f)) return;
    LobePath next = path;
    next.ray = ray_from(point, onward.direction);
    next.throughput = throughput * onward.weight;
    next.width = onward.width;
    next.length = length;
    next.met = path.met + 1;
    next.from = point;
    next.density = onward.density;
    next.of_lights = onward.of_lamps;
    next.key = mix64(path.key);
    if (next.met < settings_.bounces || light_.may_find_light(next.ray.origin, onward.direction))
        w.next.push_back(next);
}

void LobePaths::trace_packet(const LobePath* paths, int count, Workspace& w) const
{
    for (int lane = 0; lane < count; ++lane) set_lane(w.packet.ray, static_cast<std::size_t>(lane), paths[lane].ray);
    LaneWeights passed;
    intersect(rays_, (1u << count) - 1u, w.packet, passed);
    w.rays += static_cast<std::uint64_t>(count);
    FacePacket faces;
    find_faces(rays_, w.packet, faces);
    for (int lane = 0; lane < count; ++lane) {
        const LobePath& path = paths[lane];
        const glm::vec3 throughput = path.throughput * passed.weight[lane];
        const bool missed = w.packet.geometry[lane] == RayPacket::kMiss;
        const float distance = missed ? std::numeric_limits<float>::infinity() : w.packet.ray.t_max[lane];
        if (path.met == 0) {
            path.first->distance = distance;
            path.first->target = missed ? path.ray.direction : g_.position(path.pixel) + distance * path.ray.direction;
        }
        if (missed) {
            add_sky(path, throughput);
            continue;
        }
        HitSurface hit = begin_hit(rays_, w.packet, faces, lane);
        complete_hit(rays_, w.packet, lane, hit);
        shade(path, lane, hit, throughput, w);
    }
}

/// @return how many
std::size_t LobePaths::look(std::size_t begin, std::size_t end, RayRing& ring, Workspace& w) const
{
    if (!looks_) return 0;
    w.looking.looks.clear();
    const std::size_t before = w.shadow.size();
    for (std::size_t i = begin; i < end; ++i) {
        if (!is_traced(i)) continue;
        if (past_ && !past_->looks(i))
            std::fill(ring.looks_of(i).begin(), ring.looks_of(i).end(), LobeRay{});
        else
            looks_->look(i, ~lobe_key(settings_.seed, pixel_number(view_, i)), ring, w.looking, w.shadow, w.lights);
    }
    return w.shadow.size() - before;
}

void LobePaths::trace(std::size_t begin, std::size_t end, RayRing& ring, Workspace& w) const
{
    w.shadow.clear();
    w.lights.clear();
    w.paths.clear();
    for (std::size_t i = begin; i < end; ++i)
        if (is_traced(i)) begin_paths(i, ring, w);
    while (!w.paths.empty()) {
        w.next.clear();
        for (std::size_t i = 0; i < w.paths.size(); i += kWidth)
            trace_packet(&w.paths[i], static_cast<int>(std::min<std::size_t>(kWidth, w.paths.size() - i)), w);
        std::swap(w.paths, w.next);
    }
    const std::size_t looks = look(begin, end, ring, w);
    w.shadow.trace(rays_);
    w.looks += looks;
    w.shadow_rays += w.shadow.size() - looks;
    for (std::size_t i = 0; i < w.shadow.size(); ++i)
        if (w.shadow.is_free(i)) *w.lights[i].sum += w.lights[i].radiance * w.shadow.transmittance(i);
}

}  // namespace rcs
