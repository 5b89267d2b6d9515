#include "records/gatherer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "facts/scene_effects.h"
#include "records/aimed_rays.h"
#include "records/gather.h"
#include "records/known_record.h"
#include "util/color.h"
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

void add(HemisphereSamples& samples, std::uint32_t cell, glm::vec3 radiance)
{
    samples.red[cell] += radiance.r;
    samples.green[cell] += radiance.g;
    samples.blue[cell] += radiance.b;
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

/// What the rays went through on their way.
void tint(int cells, GatherWorkspace& w)
{
    const auto weight_of = [&](std::size_t cell) {
        return w.weights[cell / kWidth].weight[static_cast<int>(cell % kWidth)];
    };
    for (std::size_t cell = 0; cell < static_cast<std::size_t>(cells); ++cell) {
        const glm::vec3 weight = weight_of(cell);
        w.samples.red[cell] *= weight.r;
        w.samples.green[cell] *= weight.g;
        w.samples.blue[cell] *= weight.b;
    }
    for (LampHit& hit : w.lamp_hits) hit.radiance *= weight_of(hit.cell);
}

glm::vec3 to_scene(const Basis& frame, glm::vec3 local)
{
    return local.x * frame.x + local.y * frame.y + local.z * frame.z;
}

HemisphereIntegrals integrals_of(const GatherSize& size, GatherWorkspace& w)
{
    return w.aimed.scale.empty() ? integrate(size.grid, w.samples) : integrate_mixed(size, w);
}

}  // namespace

Gatherer::Gatherer(const LitScene& scene, const RecordSettings& options)
    : rays_(scene.rays),
      radiance_(scene.rays, scene.cache, effects_or_scene(options.effects, scene.rays), scene.gathered),
      guide_(scene.guide && scene.guide->has_light() ? scene.guide : nullptr),
      gathered_(scene.gathered && scene.gathered->any() ? scene.gathered : nullptr),
      map_(scene.arrivals),
      direct_(scene.direct),
      has_bounce_(options.bounces > 0),
      keeps_radiance_(options.radiance)
{
}

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
    }
    add(w.samples, cell, hit.part * kInversePi * reflectance * light->irradiance);
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
        if (part > 0.0f && !known)
            radiance_.direct(hit.point, surface.bsdf, outgoing, random, [&](const Ray& ray, glm::vec3 radiance) {
                w.shadow.add(ray);
                ShadowedLight& light = w.lights.emplace_back();
                light.cell = cell;
                light.material = ShadowedLight::kReflected;
                light.radiance = part * radiance;
            });
        if (radiance_.has_cache()) add(w.samples, cell, radiance_.indirect(hit.point, surface.bsdf, outgoing, random));
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
        add(w.samples, cell,
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
        if (light.material != ShadowedLight::kReflected)
            radiance *= radiance_.reflectance(
                {light.material, light.uv, light.uv_per_length, cone_width(light.cell, w)}, light.normal,
                -ray_direction(w.packets[light.cell / kWidth].ray, static_cast<int>(light.cell % kWidth)),
                light.to_light);
        add(w.samples, light.cell, radiance);
    }
    w.shadow_rays += w.shadow.size();
}

void Gatherer::shade(const Birth& birth, GatherWorkspace& w) const
{
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

/// Beside the light of all other surfaces, which the integrals have, that of gathered lamps.
void Gatherer::add_lamps(const GatherSize& size, HemisphereIntegrals& integrals, GatherWorkspace& w,
                         Record& record) const
{
    record.gathered_lamps = gathered_ ? gathered_->id : 0;
    if (w.lamp_hits.empty()) return;
    const glm::vec3 of_others = integrals.irradiance;
    for (const LampHit& hit : w.lamp_hits) add(w.samples, hit.cell, hit.radiance);
    integrals = integrals_of(size, w);
    record.of_lamps = glm::max(integrals.irradiance - of_others, 0.0f);
}

Record Gatherer::gather(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const
{
    aim(birth, size, w);
    trace_cells(w);
    shade(birth, w);
    w.shadow.trace(rays_);
    w.look_rays.trace(rays_);
    return finish(birth, size, w);
}

Record Gatherer::finish(const Birth& birth, const GatherSize& size, GatherWorkspace& w) const
{
    add_shadowed(w);
    if (rays_.has_transparency()) tint(size.cells(), w);
    HemisphereIntegrals integrals = integrals_of(size, w);
    Record record;
    record.position = birth.position;
    record.normal = birth.normal;
    w.error_of_looks = w.error_of_points = 0.0f;
    w.arrived.clear();
    if (guide_) finish_looks(birth, w, record);
    if (keeps_radiance_) record.radiance = radiance(size, w);  // before that of lamps, which it leaves out
    if (keeps_radiance_ && gathered_) record.radiance_of_lamps = radiance_of_lamps(size, w);
    add_lamps(size, integrals, w, record);
    if (map_) note_arrivals(*map_, birth, w);
    record.irradiance += integrals.irradiance;
    for (std::size_t i = 0; i < 3; ++i) {
        record.rotation_gradient[i] += to_scene(w.frame, integrals.rotation_gradient[i]);
        record.translation_gradient[i] += to_scene(w.frame, integrals.translation_gradient[i]);
    }
    w.error_of_rays = integrals.standard_error;
    const float error = std::hypot(w.error_of_rays, w.error_of_looks);
    record.harmonic_mean_distance = integrals.harmonic_mean_distance;
    record.minimum_distance = integrals.minimum_distance;
    record.gradient_reach = gradient_reach(record);
    record.footprint = birth.footprint;
    record.watch.origin = birth.origin;
    record.watch.geometric_normal = birth.geometric_normal;
    record.watch.instance = birth.instance;
    record.rays = size.rays();
    const float e = luminance(record.irradiance);
    record.noise = e > 0.0f ? std::min(1.0f, error / e) : 0.0f;
    return record;
}

Record Gatherer::difference(const Birth& birth, const HemisphereGrid& grid, std::span<glm::vec3> seen,
                            GatherWorkspace& w) const
{
    aim_cells(birth, grid, w);
    trace_cells(w);
    shade(birth, w);
    w.shadow.trace(rays_);
    add_shadowed(w);
    if (rays_.has_transparency()) tint(grid.cells, w);
    HemisphereSamples& s = w.samples;
    bool any = false;
    for (std::size_t c = 0; c < seen.size(); ++c) {
        if ((w.wanted >> c & 1u) == 0u) continue;  // nothing
        const glm::vec3 now(s.red[c], s.green[c], s.blue[c]), change = now - seen[c];
        seen[c] = now;
        any |= change != glm::vec3(0.0f);
        s.red[c] = change.r, s.green[c] = change.g, s.blue[c] = change.b;
    }
    Record change;
    if (!any) return change;
    const HemisphereIntegrals integrals = integrate(grid, s);
    change.irradiance = integrals.irradiance;
    for (std::size_t i = 0; i < 3; ++i) {
        change.rotation_gradient[i] = to_scene(w.frame, integrals.rotation_gradient[i]);
        change.translation_gradient[i] = to_scene(w.frame, integrals.translation_gradient[i]);
    }
    w.arrived.clear();
    if (keeps_radiance_) change.radiance = radiance({grid}, w);
    change.noise = integrals.standard_error;
    return change;
}

}  // namespace rcs
