#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "light/hit_light.h"
#include "light/lights.h"
#include "rays/hit_surface.h"
#include "rays/packet.h"
#include "rays/shadow_batch.h"
#include "rcs/records.h"
#include "records/gather.h"
#include "records/hemisphere.h"
#include "scene/texture.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kWidth = RayPacket::kWidth;
constexpr float kInversePi = std::numbers::inv_pi_v<float>;

/// Where a record is born.
struct Birth {
    glm::vec3 position;  // scene space, on the surface
    glm::vec3 origin;    // of its rays: moved off the surface by the rounding bound
    glm::vec3 normal, geometric_normal;
    float footprint;
    std::uint64_t key;
};

Birth birth_at(const GBuffer& g, std::uint32_t pixel, std::uint64_t seed)
{
    Birth b;
    b.position = g.scene_position(pixel);
    b.normal = g.normal(pixel);
    b.geometric_normal = g.geometric_normal[pixel];
    b.origin = b.position + g.position_error[pixel] * b.geometric_normal;
    b.footprint = g.footprint[pixel];
    // Keyed by place, not by pixel: a record made in another pass or view is another sample.
    std::uint64_t key = stream_key(seed, Stream::gather, std::bit_cast<std::uint32_t>(b.position.x));
    key = mix64(key ^ std::bit_cast<std::uint32_t>(b.position.y));
    b.key = mix64(key ^ std::bit_cast<std::uint32_t>(b.position.z));
    return b;
}

/// One thread's working memory for a record at a time.
struct Workspace {
    std::vector<float> x, y, z;
    std::vector<HitPacket> packets;
    ShadowBatch shadow;
    std::vector<std::uint32_t> shadow_cell;  // which cell a shadow ray's light belongs to
    std::vector<glm::vec3> shadow_light;     // radiance towards the record if the ray is free
    HemisphereSamples samples;
    std::uint64_t hemisphere_rays = 0;
    std::uint64_t shadow_rays = 0;

    explicit Workspace(const HemisphereGrid& grid) : samples(grid.cells)
    {
        const std::size_t packets_needed = static_cast<std::size_t>((grid.cells + kWidth - 1) / kWidth);
        x.resize(packets_needed * kWidth);
        y.resize(x.size());
        z.resize(x.size());
        packets.resize(packets_needed);
        for (HitPacket& packet : packets)
            reset(packet.ray);
    }
};

/// Directions to all cells into packets; bit i of `active[p]` is set where a ray leaves the surface.
std::uint32_t fill_packet(const Frame& frame, const Birth& birth, Workspace& w, int first, int cells)
{
    HitPacket& packet = w.packets[static_cast<std::size_t>(first / kWidth)];
    std::uint32_t active = 0;
    for (int i = 0; i < kWidth; ++i) {
        const std::size_t c = static_cast<std::size_t>(first + i);
        packet.ray.direction_x[i] = frame.x.x * w.x[c] + frame.y.x * w.y[c] + frame.z.x * w.z[c];
        packet.ray.direction_y[i] = frame.x.y * w.x[c] + frame.y.y * w.y[c] + frame.z.y * w.z[c];
        packet.ray.direction_z[i] = frame.x.z * w.x[c] + frame.y.z * w.y[c] + frame.z.z * w.z[c];
        packet.ray.origin_x[i] = birth.origin.x;
        packet.ray.origin_y[i] = birth.origin.y;
        packet.ray.origin_z[i] = birth.origin.z;
        packet.ray.t_max[i] = std::numeric_limits<float>::infinity();
        const float above = packet.ray.direction_x[i] * birth.geometric_normal.x +
                            packet.ray.direction_y[i] * birth.geometric_normal.y +
                            packet.ray.direction_z[i] * birth.geometric_normal.z;
        active |= static_cast<std::uint32_t>(above > 0.0f && first + i < cells) << i;
    }
    return active;
}

/// The mip level at which a texel is as wide as the cone of one hemisphere ray at the hit.
int mip_level(const Texture& texture, float log2_cone_width, const HitSurface& hit)
{
    const float size = static_cast<float>(std::max(texture.levels[0].width, texture.levels[0].height));
    return static_cast<int>(std::log2(size) + hit.log2_uv_per_length + log2_cone_width + 0.5f);
}

void add_shadow_ray(Workspace& w, const SurfacePoint& point, glm::vec3 to_light, float distance, std::uint32_t cell,
                    glm::vec3 radiance)
{
    w.shadow.add(shadow_ray_from(point, to_light, distance));
    w.shadow_cell.push_back(cell);
    w.shadow_light.push_back(radiance);
}

/// A direction over the point, in proportion to the cosine to its shading normal.
glm::vec3 cosine_direction(const SurfacePoint& point, RandomStream& random)
{
    const float sin2 = random.next();
    const Frame frame = make_frame(point.shading_normal, random.next());
    return std::sqrt(sin2) * frame.x + std::sqrt(1.0f - sin2) * frame.z;
}

class Gatherer {
public:
    Gatherer(const RayScene& rays, const RecordOptions& options)
        : rays_(rays), scene_(rays.scene()), grid_(make_hemisphere_grid(options.rays)), lights_(collect_lights(rays)),
          hit_lights_(lights_), sky_(scene_.sky_radiance), has_sky_(luminance(sky_) > 0.0f),
          has_bounce_(options.bounces > 0)
    {
    }

    const HemisphereGrid& grid() const { return grid_; }
    Record gather(const Birth& birth, Workspace& w) const;

private:
    void trace(const Birth& birth, const Frame& frame, Workspace& w) const;
    void shade(int first, std::uint32_t active, std::uint64_t key, Workspace& w) const;
    void shade_hit(const HitPacket& packet, int lane, std::uint32_t cell, std::uint64_t key, Workspace& w) const;
    void shoot_shadow_rays(Workspace& w) const;

    const RayScene& rays_;
    const Scene& scene_;
    HemisphereGrid grid_;
    Lights lights_;
    HitLights hit_lights_;
    glm::vec3 sky_;
    bool has_sky_;
    bool has_bounce_;
};

void Gatherer::shade_hit(const HitPacket& packet, int lane, std::uint32_t cell, std::uint64_t key, Workspace& w) const
{
    const HitSurface hit = hit_surface(rays_, packet, lane);
    const Material& material = scene_.materials[static_cast<std::size_t>(hit.point.material)];
    glm::vec3 albedo = material.base_color;
    if (material.base_color_texture >= 0) {
        const Texture& texture = scene_.textures[static_cast<std::size_t>(material.base_color_texture)];
        // A cell spans pi / (M N cos theta) of solid angle.
        const float solid_angle = std::numbers::pi_v<float> / (static_cast<float>(grid_.cells) * w.samples.cosine[cell]);
        const float log2_width = 0.5f * std::log2(solid_angle) + std::log2(packet.ray.t_max[lane]);
        albedo *= sample_nearest(texture, hit.point.uv, mip_level(texture, log2_width, hit));
    }
    if (albedo.r + albedo.g + albedo.b <= 0.0f)
        return;
    RandomStream random(mix64(key ^ cell));
    const float choice = random.next();
    const HitLights::Sample light = hit_lights_.sample(hit.point, choice, random);
    if (luminance(light.irradiance) > 0.0f)
        add_shadow_ray(w, hit.point, light.to_light, light.distance, cell, albedo * kInversePi * light.irradiance);
    if (has_sky_) {
        const glm::vec3 direction = cosine_direction(hit.point, random);
        if (glm::dot(direction, hit.point.geometric_normal) > 0.0f)
            add_shadow_ray(w, hit.point, direction, std::numeric_limits<float>::infinity(), cell, albedo * sky_);
    }
}

void Gatherer::shade(int first, std::uint32_t active, std::uint64_t key, Workspace& w) const
{
    const HitPacket& packet = w.packets[static_cast<std::size_t>(first / kWidth)];
    for (int i = 0; i < kWidth; ++i)
        if ((active >> i & 1u) != 0u && packet.geometry[i] != RayPacket::kMiss)
            prefetch_hit_surface(rays_, packet, i);
    for (int i = 0; i < kWidth && first + i < grid_.cells; ++i) {
        const std::size_t c = static_cast<std::size_t>(first + i);
        const bool alive = (active >> i & 1u) != 0u;
        const bool hit = alive && packet.geometry[i] != RayPacket::kMiss;
        const glm::vec3 seen = alive && !hit ? sky_ : glm::vec3(0.0f);
        w.samples.red[c] = seen.r;
        w.samples.green[c] = seen.g;
        w.samples.blue[c] = seen.b;
        w.samples.cosine[c] = w.z[c];
        w.samples.inverse_distance[c] = hit ? 1.0f / std::max(packet.ray.t_max[i], 1e-30f) : 0.0f;
        if (hit && has_bounce_)
            shade_hit(packet, i, static_cast<std::uint32_t>(c), key, w);
    }
}

void Gatherer::shoot_shadow_rays(Workspace& w) const
{
    w.shadow.trace(rays_);
    for (std::size_t i = 0; i < w.shadow.size(); ++i) {
        if (!w.shadow.is_free(i))
            continue;
        const std::size_t c = w.shadow_cell[i];
        w.samples.red[c] += w.shadow_light[i].r;
        w.samples.green[c] += w.shadow_light[i].g;
        w.samples.blue[c] += w.shadow_light[i].b;
    }
    w.shadow_rays += w.shadow.size();
}

void Gatherer::trace(const Birth& birth, const Frame& frame, Workspace& w) const
{
    RandomStream random(birth.key);
    const glm::vec2 shift(random.next(), random.next());
    hemisphere_directions(grid_, shift, w.x.data(), w.y.data(), w.z.data());
    w.shadow.clear();
    w.shadow_cell.clear();
    w.shadow_light.clear();
    const std::uint64_t light_key = mix64(birth.key + 1);
    for (int first = 0; first < grid_.cells; first += kWidth) {
        const std::uint32_t active = fill_packet(frame, birth, w, first, grid_.cells);
        intersect(rays_, active, w.packets[static_cast<std::size_t>(first / kWidth)]);
        w.hemisphere_rays += static_cast<std::uint64_t>(std::popcount(active));
        shade(first, active, light_key, w);
    }
    shoot_shadow_rays(w);
}

glm::vec3 to_scene(const Frame& frame, glm::vec3 local)
{
    return local.x * frame.x + local.y * frame.y + local.z * frame.z;
}

Record Gatherer::gather(const Birth& birth, Workspace& w) const
{
    const Frame frame = make_frame(birth.normal, to_unit_float(static_cast<std::uint32_t>(mix64(birth.key + 2))));
    trace(birth, frame, w);
    const HemisphereIntegrals integrals = integrate(grid_, w.samples);
    Record record;
    record.position = birth.position;
    record.normal = birth.normal;
    record.irradiance = integrals.irradiance;
    for (std::size_t i = 0; i < 3; ++i) {
        record.rotation_gradient[i] = to_scene(frame, integrals.rotation_gradient[i]);
        record.translation_gradient[i] = to_scene(frame, integrals.translation_gradient[i]);
    }
    record.harmonic_mean_distance = integrals.harmonic_mean_distance;
    record.minimum_distance = integrals.minimum_distance;
    record.footprint = birth.footprint;
    const float e = luminance(integrals.irradiance);
    record.noise = e > 0.0f ? std::min(1.0f, integrals.standard_error / e) : 0.0f;
    return record;
}

}  // namespace

struct RecordGatherer::Impl {
    Gatherer gatherer;
    std::uint64_t seed;
};

RecordGatherer::RecordGatherer(const RayScene& rays, const RecordOptions& options)
    : impl_(new Impl{Gatherer(rays, options), options.seed})
{
}

RecordGatherer::~RecordGatherer() = default;

std::vector<Record> RecordGatherer::gather(const GBuffer& gbuffer, const std::vector<std::uint32_t>& pixels,
                                           ThreadPool& pool, RecordStats& stats) const
{
    const Gatherer& gatherer = impl_->gatherer;
    std::vector<Record> records(pixels.size());
    std::vector<Workspace> workspaces(static_cast<std::size_t>(pool.size()), Workspace(gatherer.grid()));
    pool.parallel_for(pixels.size(), 4, [&](std::size_t begin, std::size_t end, int thread) {
        for (std::size_t i = begin; i < end; ++i)
            records[i] = gatherer.gather(birth_at(gbuffer, pixels[i], impl_->seed),
                                         workspaces[static_cast<std::size_t>(thread)]);
    });
    for (const Workspace& w : workspaces) {
        stats.hemisphere_rays += w.hemisphere_rays;
        stats.shadow_rays += w.shadow_rays;
    }
    stats.records += records.size();
    return records;
}

std::vector<Record> gather_records(const RayScene& rays, const GBuffer& gbuffer,
                                   const std::vector<std::uint32_t>& pixels, const RecordOptions& options,
                                   ThreadPool& pool, RecordStats& stats)
{
    return RecordGatherer(rays, options).gather(gbuffer, pixels, pool, stats);
}

}  // namespace rcs
