#include "glossy/traced_lobes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "rays/hit_surface.h"
#include "rays/packet.h"
#include "rays/shadow_batch.h"
#include "util/color.h"
#include "util/random.h"

namespace rcs {
namespace {

constexpr int kWidth = RayPacket::kWidth;
constexpr int kNeighbours = 16;
constexpr int kMostReach = 12;  // of a neighbour [px]
constexpr int kBand = 64;       // rows that are shared at a time
constexpr int kKeptRows = kBand + 2 * kMostReach;

/// One ray along a pixel's lobe, and what came back.
struct LobeRay {
    glm::vec3 target{0.0f};    // where it hit, relative to the camera; or its direction if it hit nothing
    float distance = 0.0f;     // [m]; +inf: nothing
    float density = 0.0f;      // [1/sr]; 0: no ray
    glm::vec3 radiance{0.0f};
};
static_assert(sizeof(LobeRay) == 32);

/// The rays of the rows being worked on: a ring of kKeptRows rows.
class RayRing {
public:
    RayRing(int width, int rays)
        : width_(static_cast<std::size_t>(width)), rays_(static_cast<std::size_t>(rays)), ring_(width_ * kKeptRows * rays_)
    {
    }
    std::size_t count() const { return rays_; }
    LobeRay* of(std::size_t pixel) { return ring_.data() + place(pixel); }
    const LobeRay* of(std::size_t pixel) const { return ring_.data() + place(pixel); }

private:
    std::size_t place(std::size_t pixel) const
    {
        return (pixel / width_ % kKeptRows * width_ + pixel % width_) * rays_;
    }
    std::size_t width_, rays_;
    std::vector<LobeRay> ring_;
};

/// A ray of the packet in hand, and whose it is.
struct Lane {
    std::size_t pixel;
    std::size_t number;  // of the pixel's rays
};

/// Points of a lattice in three dimensions (Roberts 2018), shifted at random per pixel.
glm::vec3 lattice_point(int n, glm::vec3 shift)
{
    const glm::vec3 p = shift + static_cast<float>(n) * glm::vec3(0.8191725f, 0.6710436f, 0.5497005f);
    return p - glm::floor(p);
}

struct PendingLight {
    LobeRay* ray;
    glm::vec3 radiance;
};

struct Workspace {
    HitPacket packet;
    ShadowBatch shadow;
    std::vector<PendingLight> lights;
    std::uint64_t rays = 0, shadow_rays = 0;

    Workspace() { reset(packet.ray); }
};

/// What one pixel's lobe reflects, and the standard error of its luminance.
struct PixelLight {
    glm::vec3 radiance{0.0f};
    float error = 0.0f;
};

/// Rays' light weighted by a lobe: the weighted mean, and how uncertain that is.
struct WeightedLight {
    glm::vec3 sum{0.0f}, total{0.0f};  // of weight times radiance, and of weights
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
        if (!(w > 0.0f))
            return 0.0f;
        const float ratio = luminance(sum) / w;
        return std::sqrt(std::max(0.0f, squares - 2.0f * ratio * products + ratio * ratio * square_weights)) / w;
    }
    float error_of_mean(float count) const
    {
        const float mean = luminance(sum) / count;
        return std::sqrt(std::max(0.0f, squares / count - mean * mean) / count);
    }
};

class LobeTracer {
public:
    LobeTracer(const RayScene& rays, const HitRadiance& light, const GBuffer& g, const View& view,
               const Shading& shading, std::uint64_t seed)
        : rays_(rays), light_(light), g_(g), camera_(view.camera), shading_(shading), seed_(seed)
    {
    }

    void trace(std::size_t begin, std::size_t end, RayRing& ring, Workspace& w) const;
    PixelLight share(std::size_t pixel, const RayRing& ring) const;

private:
    bool is_traced(std::size_t i) const { return g_.covered(i) && has_traced_part(shading_.bsdf[i]); }
    std::uint64_t key(std::size_t pixel) const { return stream_key(seed_, Stream::glossy, pixel); }
    void shade_packet(const Lane* lanes, int count, RayRing& ring, Workspace& w) const;
    float mean_distance(std::size_t pixel, const RayRing& ring) const;
    bool may_share(std::size_t pixel, std::size_t neighbour) const;

    const RayScene& rays_;
    const HitRadiance& light_;
    const GBuffer& g_;
    const Camera& camera_;
    const Shading& shading_;
    std::uint64_t seed_;
};

/// Shoots the packet and lights what it hits.
void LobeTracer::shade_packet(const Lane* lanes, int count, RayRing& ring, Workspace& w) const
{
    const std::uint32_t active = (1u << count) - 1u;
    LaneWeights passed;
    intersect(rays_, active, w.packet, passed);
    w.rays += static_cast<std::uint64_t>(count);
    FacePacket faces;
    find_faces(rays_, w.packet, faces);
    for (int lane = 0; lane < count; ++lane) {
        const std::size_t pixel = lanes[lane].pixel;
        LobeRay& ray = ring.of(pixel)[lanes[lane].number];
        const RayPacket& p = w.packet.ray;
        const glm::vec3 direction(p.direction_x[lane], p.direction_y[lane], p.direction_z[lane]);
        if (w.packet.geometry[lane] == RayPacket::kMiss) {
            ray.target = direction;
            ray.distance = std::numeric_limits<float>::infinity();
            ray.radiance = passed.weight[lane] * light_.environment().soft(direction);
            continue;
        }
        HitSurface hit = begin_hit(rays_, w.packet, faces, lane);
        complete_hit(rays_, w.packet, lane, hit);
        ray.distance = p.t_max[lane];
        ray.target = g_.position(pixel) + ray.distance * direction;
        const Bsdf& bsdf = shading_.bsdf[pixel];
        // The cone of directions that one of the rays stands for.
        const float cone = ray.distance / std::sqrt(std::max(ray.density, 1e-4f) * static_cast<float>(ring.count()));
        const float cone_width = bsdf.alpha > 2.0f * Bsdf::kLeastAlpha ? cone : 0.0f;
        const glm::vec3 weight = passed.weight[lane];
        RandomStream random(mix64(key(pixel) + 2 * lanes[lane].number + 1));
        glm::vec3 albedo;
        const auto add = [&](glm::vec3 factor) {
            return [&w, &ray, factor](const Ray& shadow_ray, glm::vec3 radiance) {
                w.shadow.add(shadow_ray);
                w.lights.push_back({&ray, factor * radiance});
            };
        };
        if (light_.is_plain(w.packet.instance(lane))) {
            const HitRadiance::PlainHit plain{hit.point.material, hit.point.uv, hit.uv_per_length, cone_width};
            albedo = light_.albedo(plain, -glm::dot(hit.point.shading_normal, direction));
            light_.direct(hit.point, random, [&](const Ray& shadow_ray, glm::vec3 white) {
                const glm::vec3 towards = light_.reflectance(plain, hit.point.shading_normal, -direction, shadow_ray.direction);
                add(weight * towards)(shadow_ray, white);
            });
        } else {
            const Bsdf there = light_.bsdf(w.packet, lane, hit, cone_width);
            albedo = total_albedo(there, -direction);
            light_.direct(hit.point, there, -direction, random, add(weight));
        }
        ray.radiance += weight * albedo * std::numbers::inv_pi_v<float> * light_.indirect_irradiance(hit.point, random);
    }
}

void LobeTracer::trace(std::size_t begin, std::size_t end, RayRing& ring, Workspace& w) const
{
    Lane lanes[kWidth];
    int count = 0;
    w.shadow.clear();
    w.lights.clear();
    for (std::size_t i = begin; i < end; ++i) {
        if (!is_traced(i))
            continue;
        const Bsdf part = traced_part(shading_.bsdf[i]);
        const glm::vec3 outgoing = outgoing_at(g_, camera_, i);
        RandomStream random(key(i));
        const glm::vec3 shift(random.next(), random.next(), random.next());
        LobeRay* const own = ring.of(i);
        std::fill(own, own + ring.count(), LobeRay{});
        for (std::size_t n = 0; n < ring.count(); ++n) {
            const glm::vec3 point = lattice_point(static_cast<int>(n), shift);
            const BsdfSample sample = sample_glossy(part, outgoing, point.x, {point.y, point.z});
            if (!(sample.density > 0.0f) || sample.weight == glm::vec3(0.0f))
                continue;
            own[n].density = sample.density;
            const bool outwards = glm::dot(sample.incoming, g_.geometric_normal[i]) >= 0.0f;
            const glm::vec3 origin =
                g_.scene_position(i) + (outwards ? g_.position_error[i] : -g_.position_error[i]) * g_.geometric_normal[i];
            RayPacket& p = w.packet.ray;
            p.origin_x[count] = origin.x;
            p.origin_y[count] = origin.y;
            p.origin_z[count] = origin.z;
            p.direction_x[count] = sample.incoming.x;
            p.direction_y[count] = sample.incoming.y;
            p.direction_z[count] = sample.incoming.z;
            p.t_max[count] = std::numeric_limits<float>::infinity();
            lanes[count++] = {i, n};
            if (count == kWidth) {
                shade_packet(lanes, count, ring, w);
                count = 0;
            }
        }
    }
    if (count > 0)
        shade_packet(lanes, count, ring, w);
    w.shadow.trace(rays_);
    w.shadow_rays += w.shadow.size();
    for (std::size_t i = 0; i < w.shadow.size(); ++i)
        if (w.shadow.is_free(i))
            w.lights[i].ray->radiance += w.lights[i].radiance * w.shadow.transmittance(i);
}

/// Harmonic mean over the pixel's own rays [m].
float LobeTracer::mean_distance(std::size_t pixel, const RayRing& ring) const
{
    float inverse = 0.0f, count = 0.0f;
    const LobeRay* const own = ring.of(pixel);
    for (std::size_t n = 0; n < ring.count(); ++n) {
        if (!(own[n].density > 0.0f))
            continue;
        inverse += 1.0f / own[n].distance;
        count += 1.0f;
    }
    return inverse > 0.0f ? count / inverse : std::numeric_limits<float>::infinity();
}

/// Whether a neighbour lies on the same, about equally glossy surface: within the plane by the pixel's footprint.
bool LobeTracer::may_share(std::size_t pixel, std::size_t neighbour) const
{
    if (!is_traced(neighbour))
        return false;
    const Bsdf &here = shading_.bsdf[pixel], &there = shading_.bsdf[neighbour];
    const glm::vec3 offset = g_.position(neighbour) - g_.position(pixel);
    return glm::dot(g_.geometric_normal[pixel], g_.geometric_normal[neighbour]) > 0.9f &&
           std::abs(glm::dot(offset, g_.geometric_normal[pixel])) < 0.1f * glm::length(offset) + g_.footprint[pixel] &&
           there.alpha < 2.0f * here.alpha && here.alpha < 2.0f * there.alpha;
}

PixelLight LobeTracer::share(std::size_t pixel, const RayRing& ring) const
{
    const Bsdf part = traced_part(shading_.bsdf[pixel]);
    const glm::vec3 outgoing = outgoing_at(g_, camera_, pixel);
    const glm::vec3 position = g_.position(pixel);
    WeightedLight light;
    const auto add = [&](std::size_t from) {
        const LobeRay* const rays = ring.of(from);
        for (std::size_t n = 0; n < ring.count(); ++n) {
            const LobeRay& ray = rays[n];
            if (!(ray.density > 0.0f))
                continue;
            glm::vec3 incoming = ray.target;
            float density = ray.density;
            if (std::isfinite(ray.distance)) {
                incoming = ray.target - position;
                const float d2 = glm::dot(incoming, incoming);
                incoming /= std::sqrt(d2);
                density *= d2 / (ray.distance * ray.distance);
            }
            const glm::vec3 weight =
                evaluate_glossy(part, outgoing, incoming) * (std::abs(glm::dot(part.normal, incoming)) / density);
            light.add(weight, ray.radiance);
        }
    };
    add(pixel);
    // Beyond the width of the lobe where it hits, a neighbour sees other things.
    const float narrowest = part.has_coat() ? std::min(part.coat_alpha, part.alpha) : part.alpha;
    const float reach = std::min(static_cast<float>(kMostReach), narrowest * mean_distance(pixel, ring) / g_.footprint[pixel]);
    if (reach >= 1.0f && !part.transmits()) {
        const int x = static_cast<int>(pixel % static_cast<std::size_t>(g_.width));
        const int y = static_cast<int>(pixel / static_cast<std::size_t>(g_.width));
        const float turn = 2.0f * std::numbers::pi_v<float> * to_unit_float(static_cast<std::uint32_t>(mix64(key(pixel) + 77)));
        for (int n = 0; n < kNeighbours; ++n) {
            // Vogel's spiral: even over the disc.
            const float radius = reach * std::sqrt((static_cast<float>(n) + 0.5f) / kNeighbours);
            const float angle = turn + 2.3999632f * static_cast<float>(n);
            const int nx = x + static_cast<int>(std::lround(radius * std::cos(angle)));
            const int ny = y + static_cast<int>(std::lround(radius * std::sin(angle)));
            if (nx < 0 || ny < 0 || nx >= g_.width || ny >= g_.height || (nx == x && ny == y))
                continue;
            const std::size_t neighbour =
                static_cast<std::size_t>(ny) * static_cast<std::size_t>(g_.width) + static_cast<std::size_t>(nx);
            if (may_share(pixel, neighbour))
                add(neighbour);
        }
    }
    if (part.transmits()) {
        const float count = static_cast<float>(ring.count());
        return {light.sum / count, light.error_of_mean(count)};
    }
    const glm::vec3 albedo = specular_albedo(part, glm::dot(part.normal, outgoing));
    PixelLight reflected{glm::vec3(0.0f), luminance(albedo) * light.error_of_ratio()};
    for (int c = 0; c < 3; ++c)
        reflected.radiance[c] = light.total[c] > 0.0f ? albedo[c] * light.sum[c] / light.total[c] : 0.0f;
    return reflected;
}

}  // namespace

Bsdf traced_part(const Bsdf& bsdf)
{
    Bsdf part = bsdf;
    part.diffuse = glm::vec3(0.0f);
    if (lit_by_records(bsdf)) {
        part.f0 = glm::vec3(0.0f);
        part.f90 = 0.0f;
    }
    return part;
}

TracedLight trace_lobes(const RayScene& rays, const HitRadiance& light, const GBuffer& gbuffer, const View& view,
                        const Shading& shading, int rays_per_pixel, std::uint64_t seed, ThreadPool& pool,
                        GlossyStats& stats)
{
    const auto is_traced = [&](std::size_t i) { return gbuffer.covered(i) && has_traced_part(shading.bsdf[i]); };
    const LobeTracer tracer(rays, light, gbuffer, view, shading, seed);
    RayRing ring(gbuffer.width, rays_per_pixel);
    std::vector<Workspace> workspaces(static_cast<std::size_t>(pool.size()));
    TracedLight traced{std::vector<glm::vec3>(gbuffer.size(), glm::vec3(0.0f)), std::vector<float>(gbuffer.size(), 0.0f)};
    const auto first_pixel = [&](int row) { return static_cast<std::size_t>(row) * static_cast<std::size_t>(gbuffer.width); };
    int rows_done = 0;
    for (int row = 0; row < gbuffer.height; row += kBand) {
        const int last = std::min(row + kBand, gbuffer.height), needed = std::min(last + kMostReach, gbuffer.height);
        const std::size_t from = first_pixel(rows_done);
        pool.parallel_for(first_pixel(needed) - from, 64, [&](std::size_t begin, std::size_t end, int thread) {
            tracer.trace(from + begin, from + end, ring, workspaces[static_cast<std::size_t>(thread)]);
        });
        rows_done = needed;
        const std::size_t start = first_pixel(row);
        pool.parallel_for(first_pixel(last) - start, 256, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t i = start + begin; i < start + end; ++i) {
                if (!is_traced(i))
                    continue;
                const PixelLight light_here = tracer.share(i, ring);
                traced.radiance[i] = light_here.radiance;
                traced.error[i] = light_here.error;
            }
        });
    }
    for (const Workspace& w : workspaces) {
        stats.rays += w.rays;
        stats.shadow_rays += w.shadow_rays;
    }
    return traced;
}

}  // namespace rcs
