#include "rcs/gbuffer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gbuffer/visibility.h"
#include "rays/ray_scene_impl.h"
#include "rcs/error.h"
#include "scene/surface.h"

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

void store(GBuffer& g, std::size_t i, const VisiblePoint& point)
{
    const glm::vec3 p = point.relative_position;
    const glm::vec3 n = point.surface.shading_normal;
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
bool is_doubtful(const RayScene& rays, const View& view, const Visibility& v, int x, int y)
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
            const bool known = std::any_of(looked_at, looked_at + count, [&](std::size_t j) { return same_triangle(v, i, j); });
            if (!known)
                looked_at[count++] = i;
        }
    }
    if (count == 1)
        return false;
    const CameraRay ray = camera_ray(view, x + view.pixel_offset.x, y + view.pixel_offset.y);
    return std::any_of(looked_at, looked_at + count, [&](std::size_t i) {
        if (v.instance[i] == GBuffer::kNone)
            return false;
        const double inside = pixels_inside(rays, v.instance[i], v.primitive[i], ray);
        return i == here || same_triangle(v, i, here) ? inside < kSnap : std::abs(inside) < kSnap;
    });
}

/// Whether the triangle that was drawn has holes that the rasteriser knows nothing of.
bool is_masked(const RayScene& rays, std::uint32_t instance)
{
    return instance != GBuffer::kNone &&
           rays.scene().materials[static_cast<std::size_t>(rays.impl().instances[instance].material)].alpha_mode == AlphaMode::mask;
}

/// Settles doubtful pixels by a ray: what a pixel sees is then exact, the same as for every other ray.
void settle_edges(const RayScene& rays, const View& view, ThreadPool& pool, Visibility& v)
{
    const Visibility drawn = v;
    pool.parallel_for(static_cast<std::size_t>(view.height), 8, [&](std::size_t begin, std::size_t end, int) {
        for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
            for (int x = 0; x < view.width; ++x) {
                const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
                if (!is_masked(rays, drawn.instance[i]) && !is_doubtful(rays, view, drawn, x, y))
                    continue;
                const auto hit = find_visible(rays, camera_ray(view, x + view.pixel_offset.x, y + view.pixel_offset.y));
                v.instance[i] = hit ? hit->instance : GBuffer::kNone;
                v.primitive[i] = hit ? hit->primitive : GBuffer::kNone;
            }
        }
    });
}

}  // namespace

GBuffer render_gbuffer(GlContext& gl, const RayScene& rays, const View& view, float texture_scale, ThreadPool& pool)
{
    const Scene& scene = rays.scene();
    Visibility visibility = render_visibility(gl, scene, view);
    settle_edges(rays, view, pool, visibility);
    GBuffer g = allocate(view, std::move(visibility));
    const std::size_t width = static_cast<std::size_t>(view.width);
    pool.parallel_for(static_cast<std::size_t>(view.height), 8, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = begin * width; i < end * width; ++i) {
            const double x = static_cast<double>(i % width) + view.pixel_offset.x;
            const double y = static_cast<double>(i / width) + view.pixel_offset.y;
            const CameraRay ray = camera_ray(view, x, y);
            if (!g.covered(i)) {
                g.emission[i] = environment_of(rays).radiance(glm::vec3(glm::normalize(ray.direction)));
                continue;
            }
            store(g, i, visible_point(rays, g.instance[i], g.primitive[i], ray, g.camera_position, texture_scale));
        }
    });
    return g;
}

}  // namespace rcs
