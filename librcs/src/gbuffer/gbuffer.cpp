#include "rcs/gbuffer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "gbuffer/shading.h"
#include "gbuffer/visibility.h"
#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "rcs/error.h"
#include "scene/camera_rays.h"
#include "util/counters.h"

namespace rcs {
namespace {

GBuffer allocate(const View& view, Visibility visibility)
{
    GBuffer g;
    g.width = view.width;
    g.height = view.height;
    g.camera_position = camera_position(view.camera);
    const std::size_t n = g.size();
    for (auto* plane : {&g.position_x, &g.position_y, &g.position_z, &g.normal_x, &g.normal_y, &g.normal_z,
                        &g.footprint, &g.position_error})
        plane->assign(n, 0.0f);
    g.geometric_normal.assign(n, glm::vec3(0.0f));
    g.albedo.assign(n, glm::vec3(0.0f));
    g.emission.assign(n, glm::vec3(0.0f));
    g.instance = std::move(visibility.instance);
    g.primitive = std::move(visibility.primitive);
    return g;
}

Shading allocate_shading(const RayScene& rays, const EffectSet& effects, std::size_t pixels)
{
    Shading s;
    if (effects.has(Effect::highlights) || effects.has(Effect::glossy_records) || effects.has(Effect::traced_lobes)) {
        for (const MeshTraits& traits : rays.impl().traits) s.most_lobes = std::max(s.most_lobes, traits.most_lobes);
        s.clear_lobes(pixels);
    }
    if (effects.has(Effect::peeling)) {
        s.coverage.assign(pixels, 1.0f);
        s.through.assign(pixels, glm::vec3(0.0f));
    }
    return s;
}

void store(Shading& s, std::size_t i, const VisiblePoint& point, glm::vec3 outgoing)
{
    Bsdf bsdf = point.material.bsdf;
    if (!s.coverage.empty()) {
        const float coverage = point.material.alpha;
        s.coverage[i] = coverage;
        s.through[i] = glm::vec3(1.0f - coverage);
        if (const LobeSet straight = bsdf.those(shows_straight)) {
            s.through[i] += coverage * albedo(bsdf, outgoing, straight);
            bsdf = bsdf.only(~straight);
        }
    }
    if (s.has_lobes()) s.set_lobes(i, bsdf);
}

void store(GBuffer& g, std::size_t i, const VisiblePoint& point)
{
    const glm::vec3 p = point.relative_position;
    const glm::vec3 n = point.material.bsdf.normal;
    g.position_x[i] = p.x;
    g.position_y[i] = p.y;
    g.position_z[i] = p.z;
    g.normal_x[i] = n.x;
    g.normal_y[i] = n.y;
    g.normal_z[i] = n.z;
    g.geometric_normal[i] = point.surface.geometric_normal;
    g.footprint[i] = point.footprint;
    g.position_error[i] = point.surface.position_error;
    g.albedo[i] = point.albedo;
    g.emission[i] = point.emission;
}

// OpenGL snaps corners to at least 4 subpixel bits (glspec45.core, SUBPIXEL_BITS; 8 is usual), so a sample
// this near to an edge [px] may be given to either side.
constexpr double kSnap = 1.0 / 16.0;

bool same_triangle(const Visibility& v, std::size_t a, std::size_t b)
{
    return v.instance[a] == v.instance[b] && v.primitive[a] == v.primitive[b];
}

/// Whether the rasteriser's answer at a pixel could be off by its snapping: the sample is that near to an edge
/// of a triangle seen there or at a neighbour.
bool is_doubtful(const RayScene& rays, const View& view, const CameraRays& camera, const Visibility& v, int x, int y)
{
    const auto index = [&](int px, int py) {
        return static_cast<std::size_t>(py) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(px);
    };
    const std::size_t here = index(x, y);
    std::size_t looked_at[9];
    int count = 0;
    for (int py = std::max(y - 1, 0); py <= std::min(y + 1, view.height - 1); ++py) {
        for (int px = std::max(x - 1, 0); px <= std::min(x + 1, view.width - 1); ++px) {
            const std::size_t i = index(px, py);
            const bool known =
                std::any_of(looked_at, looked_at + count, [&](std::size_t j) { return same_triangle(v, i, j); });
            if (!known) looked_at[count++] = i;
        }
    }
    if (count == 1) return false;
    const CameraRay ray = camera.of_pixel(x, y);
    return std::any_of(looked_at, looked_at + count, [&](std::size_t i) {
        if (v.instance[i] == GBuffer::kNone) return false;
        const double inside = pixels_inside(rays, v.instance[i], v.primitive[i], ray);
        return i == here || same_triangle(v, i, here) ? inside < kSnap : std::abs(inside) < kSnap;
    });
}

/// Whether the triangle that was drawn has holes that the rasteriser knows nothing of.
bool is_masked(const RayScene& rays, std::uint32_t instance)
{
    return instance != GBuffer::kNone && (rays.impl().instances[instance].simulated & kMasked) != 0u;
}

/// Settles doubtful pixels by a ray: what a pixel sees is then exact, the same as for every other ray.
void settle_edges(const RayScene& rays, const View& view, ThreadPool& pool, Visibility& v)
{
    const Visibility drawn = v;
    const CameraRays camera(view);
    pool.parallel_for(static_cast<std::size_t>(view.height), 8, [&](std::size_t begin, std::size_t end, int) {
        for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
            for (int x = 0; x < view.width; ++x) {
                const std::size_t i =
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
                if (!is_masked(rays, drawn.instance[i]) && !is_doubtful(rays, view, camera, drawn, x, y)) continue;
                tally(Count::camera_rays);
                const auto hit = find_visible(rays, camera.of_pixel(x, y));
                v.instance[i] = hit ? hit->instance : GBuffer::kNone;
                v.primitive[i] = hit ? hit->primitive : GBuffer::kNone;
            }
        }
    });
}

/// Empties the pixels that see what is known.
void leave_known(KnownSamples& known, Visibility& v)
{
    known.met.assign(v.instance.size(), 0);
    for (std::size_t i = 0; i < v.instance.size(); ++i) {
        if (v.instance[i] == GBuffer::kNone || v.instance[i] != known.instance[i] ||
            v.primitive[i] != known.primitive[i])
            continue;
        known.met[i] = 1;
        v.instance[i] = v.primitive[i] = GBuffer::kNone;
    }
}

/// Calls visit(pixel, ray through its sample) for every pixel.
template <typename Visit>
void for_each_camera_ray(const View& view, ThreadPool& pool, const Visit& visit)
{
    const std::size_t width = static_cast<std::size_t>(view.width);
    const CameraRays camera(view);
    pool.parallel_for(static_cast<std::size_t>(view.height), 8, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin * width; i < end * width; ++i)
            visit(i, camera.of_pixel(static_cast<int>(i % width), static_cast<int>(i / width)));
    });
}

}  // namespace

GBuffer render_gbuffer(GlContext& gl, const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool,
                       const EffectSet& effects, Shading& shading, KnownSamples* known)
{
    Visibility visibility = render_visibility(gl, rays.scene(), view);
    settle_edges(rays, view, pool, visibility);
    if (known) leave_known(*known, visibility);
    GBuffer g = allocate(view, std::move(visibility));
    shading = allocate_shading(rays, effects, g.size());
    for_each_camera_ray(view, pool, [&](std::size_t i, const CameraRay& ray) {
        if (!g.covered(i)) {
            if (!known || known->met[i] == 0)
                g.emission[i] = environment_of(rays).radiance(glm::vec3(glm::normalize(ray.direction)));
            return;
        }
        const VisiblePoint point =
            visible_point(rays, g.instance[i], g.primitive[i], ray, g.camera_position, texture_scale);
        store(g, i, point);
        store(shading, i, point, -glm::vec3(glm::normalize(ray.direction)));
    });
    return g;
}

GBuffer render_gbuffer(GlContext& gl, const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool)
{
    Shading unused;
    return render_gbuffer(gl, rays, view, texture_scale, pool, EffectSet{}, unused);
}

void peel_gbuffer(const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool,
                  const std::vector<glm::vec3>& weight, GBuffer& g, Shading& shading)
{
    for_each_camera_ray(view, pool, [&](std::size_t i, const CameraRay& ray) {
        const std::uint32_t instance = g.instance[i], primitive = g.primitive[i];
        g.instance[i] = g.primitive[i] = GBuffer::kNone;
        g.emission[i] = glm::vec3(0.0f);
        if (instance == GBuffer::kNone || weight[i] == glm::vec3(0.0f)) return;
        float after =
            static_cast<float>(glm::dot(glm::dvec3(g.position(i)) + g.camera_position - ray.origin, ray.direction) /
                               glm::dot(ray.direction, ray.direction));
        tally(Count::camera_rays);
        std::optional<Hit> hit = find_visible(rays, ray, after);
        // The surface just left may be met again by a rounding.
        while (hit && hit->instance == instance && hit->primitive == primitive) hit = find_visible(rays, ray, hit->t);
        if (!hit) {
            g.emission[i] = environment_of(rays).radiance(glm::vec3(glm::normalize(ray.direction)));
            return;
        }
        g.instance[i] = hit->instance;
        g.primitive[i] = hit->primitive;
        const VisiblePoint point =
            visible_point(rays, hit->instance, hit->primitive, ray, g.camera_position, texture_scale);
        store(g, i, point);
        store(shading, i, point, -glm::vec3(glm::normalize(ray.direction)));
    });
}

}  // namespace rcs
