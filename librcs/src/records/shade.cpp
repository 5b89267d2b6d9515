#include <algorithm>
#include <cmath>
#include <numbers>

#include "records/gatherer.h"
#include "util/multiversion.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kWidth = RayPacket::kWidth;
constexpr float kInversePi = std::numbers::inv_pi_v<float>;

/// Of one cell's ray where it ends [m].
float cone_width(std::uint32_t cell, const GatherWorkspace& w)
{
    return w.cell_width / (std::sqrt(w.samples.cosine[cell]) * w.samples.inverse_distance[cell]);
}

void keep_ways(const PacketCells& cells, GatherWorkspace& w)
{
    const RayPacket& rays = w.packets[cells.first / kWidth].ray;
    for (int i = 0; i < cells.count; ++i) {
        const std::size_t c = cells.first + static_cast<std::size_t>(i);
        w.ways.resize(std::max(w.ways.size(), c + 1));
        w.ways[c] = {ray_direction(rays, i), cells.is_active(i) ? rays.t_max[i] : -1.0f, static_cast<std::uint32_t>(c)};
    }
}

void keep_shadow_ways(GatherWorkspace& w)
{
    w.shadow_ways.clear();
    std::size_t i = 0;
    w.shadow.each_ray([&](glm::vec3, glm::vec3 direction, float length) {
        w.shadow_ways.push_back({direction, length, w.lights[i++].cell});
    });
}

/// What the rays themselves tell of their cells: distance, plane of the face, sky where nothing was hit.
RCS_MULTIVERSION
void note_cells(const Basis& frame, const HitPacket& packet, const FacePacket& faces, PacketCells cells, glm::vec3 sky,
                const float* cosine, HemisphereSamples& s)
{
    for (int i = 0; i < cells.count; ++i) {
        const std::size_t c = cells.first + static_cast<std::size_t>(i);
        const bool alive = cells.is_active(i);
        const bool hit = alive && packet.geometry[i] != RayPacket::kMiss;
        const float seen = alive && !hit ? 1.0f : 0.0f;
        s.red[c] = seen * sky.r;
        s.green[c] = seen * sky.g;
        s.blue[c] = seen * sky.b;
        s.cosine[c] = cosine[c];
        const float t = packet.ray.t_max[i];
        s.inverse_distance[c] = hit ? 1.0f / (t > 1e-30f ? t : 1e-30f) : 0.0f;
        const float qx = faces.plane_x[i], qy = faces.plane_y[i], qz = faces.plane_z[i];
        s.plane_x[c] = hit ? qx * frame.x.x + qy * frame.x.y + qz * frame.x.z : 0.0f;
        s.plane_y[c] = hit ? qx * frame.y.x + qy * frame.y.y + qz * frame.y.z : 0.0f;
        s.plane_z[c] = hit ? qx * frame.z.x + qy * frame.z.y + qz * frame.z.z : 0.0f;
    }
}

}  // namespace

/// Sky that is not the same everywhere, as far as it is soft: its peaks are a lamp.
void Gatherer::note_sky(const HitPacket& packet, const PacketCells& cells, HemisphereSamples& s) const
{
    for (int i = 0; i < cells.count; ++i) {
        if (!cells.is_active(i) || packet.geometry[i] != RayPacket::kMiss) continue;
        const RayPacket& ray = packet.ray;
        const glm::vec3 sky =
            radiance_.environment().soft_blurred({ray.direction_x[i], ray.direction_y[i], ray.direction_z[i]});
        const std::size_t c = cells.first + static_cast<std::size_t>(i);
        s.red[c] = sky.r;
        s.green[c] = sky.g;
        s.blue[c] = sky.b;
    }
}

/// What of a hit's light from lamps and sky is left to the ray, where lit points bring the rest. Where that is little,
/// most rays are spared it and the others bring more.
float Gatherer::rays_part(const HitPacket& packet, const Met& hit, float cosine, RandomStream random) const
{
    constexpr float kLeastPart = 0.25f;
    if (!guide_ || !guide_->can_be_lit(packet.instance(hit.lane))) return 1.0f;
    const glm::vec3 normal = hit.point.geometric_normal;
    const float t = packet.ray.t_max[hit.lane];
    const float g = cosine * -glm::dot(normal, ray_direction(packet.ray, hit.lane)) / (t * t);
    const float bound = guide_->bound(hit.point.position, hit.leaf);
    const float part = bound > 0.0f ? g / (g + bound) : 1.0f;
    if (part >= kLeastPart) return part;
    return random.next() * kLeastPart < part ? kLeastPart : 0.0f;
}

void Gatherer::note_lamp(const HitPacket& packet, int lane, const HitSurface& hit, std::uint32_t cell,
                         GatherWorkspace& w) const
{
    const glm::vec3 emission = radiance_.emission(packet, lane, hit, cone_width(cell, w));
    if (emission != glm::vec3(0.0f)) w.lamp_hits.push_back({cell, emission});
}

/// Adds how a cell's light changes as the record moves. @param part  of it that arrives
void Gatherer::add_moving(const ChangeAlong& moving, std::uint32_t cell, glm::vec3 part, GatherWorkspace& w) const
{
    if (rays_.has_transparency()) part *= w.weight_of(cell);
    for (std::size_t k = 0; k < 2; ++k) w.moving[k] += w.aimed.scale_of(cell) * part * moving[k];
}

/// Adds what is known of the light of lamps and sky at a hit. @return whether that is all of it
bool Gatherer::add_known(const HitPacket& packet, const Met& hit, std::uint32_t cell, GatherWorkspace& w) const
{
    const DirectCells::Light* const light = hit.light;
    if (!light) return false;
    if (light->to_light == glm::vec3(0.0f)) return true;
    const int lane = hit.lane;
    const glm::vec3 outgoing = -ray_direction(packet.ray, lane);
    const float width = cone_width(cell, w);
    glm::vec3 reflectance;
    if (radiance_.is_plain(packet.instance(lane))) {
        reflectance = radiance_.reflectance({hit.point.material, hit.point.uv, hit.uv_per_length, width},
                                            hit.point.shading_normal, outgoing, light->to_light);
    } else {
        const Bsdf bsdf = radiance_.widened_values(packet, lane, hit, width, w.least_hit_alpha).bsdf;
        if (bsdf.those(is_diffuse_behind) != 0u) return false;
        reflectance = std::numbers::pi_v<float> * evaluate(bsdf, outgoing, light->to_light);
        add_moving(MovingViews(bsdf, outgoing, packet.ray.t_max[lane], w.frame).change(light->to_light), cell,
                   hit.part * kInversePi * light->irradiance, w);
    }
    w.samples.add(cell, hit.part * kInversePi * reflectance * light->irradiance);
    return true;
}

/// Completes hits, and finds what is known of their light: what that reads lies anywhere in memory, so that each step
/// is taken for all of them before the next.
void Gatherer::find_known(const HitPacket& packet, std::span<Met> hits, std::uint64_t key, const PacketCells& cells,
                          GatherWorkspace& w) const
{
    for (Met& hit : hits) {
        complete_hit(rays_, packet, hit.lane, hit);
        if (!has_bounce_) continue;
        const std::size_t cell = cells.first + static_cast<std::size_t>(hit.lane);
        // A stream's own counter stays far below 2^32, so no two cells share a number.
        hit.random = RandomStream(key ^ static_cast<std::uint64_t>(cell) << 32);
        hit.part = rays_part(packet, hit, w.z[cell], RandomStream(~key ^ static_cast<std::uint64_t>(cell) << 32));
        hit.is_served = direct_ && hit.part > 0.0f && direct_->serves(hit.point.position, packet.ray.t_max[hit.lane]);
        if (hit.is_served) hit.leaf = direct_->begin(hit.point.position, hit.point.shading_normal, hit.random);
    }
    for (Met& hit : hits)
        if (hit.is_served) hit.light = direct_->find(hit.leaf, hit.random);
}

RCS_ALWAYS_INLINE void Gatherer::shade_hit(const HitPacket& packet, Met& hit, std::uint32_t cell,
                                           GatherWorkspace& w) const
{
    const int lane = hit.lane;
    const float part = hit.part;
    RandomStream& random = hit.random;
    const bool known = add_known(packet, hit, cell, w);
    if (!radiance_.is_plain(packet.instance(lane))) {
        const MaterialValues surface =
            radiance_.widened_values(packet, lane, hit, cone_width(cell, w), w.least_hit_alpha);
        const glm::vec3 outgoing = -ray_direction(packet.ray, lane);
        if (part > 0.0f && !known) {
            const MovingViews views(surface.bsdf, outgoing, packet.ray.t_max[lane], w.frame);
            const auto add_ray = [&](const Ray& ray, glm::vec3 radiance, glm::vec3 white) {
                w.shadow.add(ray);
                ShadowedLight& light = w.lights.emplace_back();
                light.cell = cell;
                light.material = ShadowedLight::kReflected;
                light.radiance = part * radiance;
                light.moving = views.change(ray.direction);
                for (glm::vec3& along : light.moving) along *= part * white;
            };
            radiance_.direct(hit.point, surface.bsdf, outgoing, random, add_ray);
        }
        if (radiance_.has_cache()) w.samples.add(cell, radiance_.indirect(hit.point, surface.bsdf, outgoing, random));
        return;
    }
    if (part > 0.0f && !known)
        radiance_.direct(hit.point, random, [&](const Ray& ray, glm::vec3 white) {
            w.shadow.add(ray);
            // Filled in place: a copy would read back in one piece what has just been written in several, and wait for
            // it.
            ShadowedLight& light = w.lights.emplace_back();
            light.cell = cell;
            light.material = hit.point.material;
            light.radiance = part * white;
            light.uv = hit.point.uv;
            light.uv_per_length = hit.uv_per_length;
            light.normal = hit.point.shading_normal;
            light.to_light = ray.direction;
        });
    if (radiance_.has_cache())
        w.samples.add(cell,
                      kInversePi *
                          radiance_.albedo({hit.point.material, hit.point.uv, hit.uv_per_length, cone_width(cell, w)},
                                           -glm::dot(hit.point.shading_normal, ray_direction(packet.ray, lane))) *
                          radiance_.indirect_irradiance(hit.point, random));
}

void Gatherer::shade_cells(const PacketCells& cells, std::uint64_t key, GatherWorkspace& w) const
{
    const HitPacket& packet = w.packets[cells.first / kWidth];
    FacePacket faces;
    find_faces(rays_, packet, faces);
    note_cells(w.frame, packet, faces, cells, radiance_.sky_radiance(), w.z.data(), w.samples);
    if (radiance_.environment().has_image()) note_sky(packet, cells, w.samples);
    if (!has_bounce_ && !gathered_) return;
    Met hits[kWidth];
    int count = 0;
    for (int i = 0; i < cells.count; ++i) {
        if (!cells.is_active(i) || packet.geometry[i] == RayPacket::kMiss) continue;
        const bool is_lamp = gathered_ && gathered_->has(packet.instance(i));
        if (!is_lamp && !has_bounce_) continue;
        if (!is_lamp && !radiance_.has_cache() &&
            !radiance_.may_be_lit(packet.instance(i), {faces.normal_x[i], faces.normal_y[i], faces.normal_z[i]}))
            continue;
        prefetch_hit(rays_, packet, i);
        Met& hit = hits[count++];
        hit = {begin_hit(rays_, packet, faces, i), i};
        if (guide_) hit.leaf = guide_->begin_bound(hit.point.position, hit.point.geometric_normal);
    }
    find_known(packet, {hits, static_cast<std::size_t>(count)}, key, cells, w);
    for (int n = 0; n < count; ++n) {
        const int lane = hits[n].lane;
        const std::uint32_t cell = static_cast<std::uint32_t>(cells.first) + static_cast<std::uint32_t>(lane);
        if (gathered_ && gathered_->has(packet.instance(lane))) note_lamp(packet, lane, hits[n], cell, w);
        if (has_bounce_) shade_hit(packet, hits[n], cell, w);
    }
}

void Gatherer::add_shadowed(GatherWorkspace& w) const
{
    for (std::size_t i = 0; i < w.shadow.size(); ++i) {
        if (!w.shadow.is_free(i)) continue;
        const ShadowedLight& light = w.lights[i];
        glm::vec3 radiance = light.radiance * w.shadow.transmittance(i);
        if (light.material == ShadowedLight::kReflected)
            add_moving(light.moving, light.cell, w.shadow.transmittance(i), w);
        else
            radiance *= radiance_.reflectance(
                {light.material, light.uv, light.uv_per_length, cone_width(light.cell, w)}, light.normal,
                -ray_direction(w.packets[light.cell / kWidth].ray, static_cast<int>(light.cell % kWidth)),
                light.to_light);
        w.samples.add(light.cell, radiance);
    }
    w.shadow_rays += w.shadow.size();
}

void Gatherer::shade(const Birth& birth, GatherWorkspace& w) const
{
    w.moving = {};
    w.shadow.clear();
    w.lights.clear();
    w.lamp_hits.clear();
    const std::uint64_t light_key = mix64(birth.key + 1 + birth.light);
    for (const PacketCells& cells : w.cells) {
        if (w.keeps_ways) keep_ways(cells, w);
        shade_cells(cells, light_key, w);
    }
    if (w.keeps_ways) keep_shadow_ways(w);
}

}  // namespace rcs
