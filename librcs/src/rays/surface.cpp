#include "rays/hit_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rays/ray_scene_impl.h"
#include "rays/surface.h"
#include "util/multiversion.h"

namespace rcs {
namespace {

/// The face's normal in double precision: long thin triangles lose theirs in float.
glm::vec3 face_normal(const std::array<glm::vec3, 3>& c)
{
    const glm::dvec3 e1 = glm::dvec3(c[1]) - glm::dvec3(c[0]);
    const glm::dvec3 e2 = glm::dvec3(c[2]) - glm::dvec3(c[0]);
    const glm::dvec3 n = glm::cross(e1, e2);
    const double length = glm::length(n);
    return length > 0.0 ? glm::vec3(n / length) : glm::vec3(0.0f, 1.0f, 0.0f);
}

/// What a surface's rounding errors are proportional to. Errors of each coordinate are as that coordinate is large, and
/// only their part along the normal lifts a point off its plane (PBRT 3.9): a ground a thousand kilometres wide is flat
/// to a micrometre where its heights are small. Instances turn coordinates into each other, so all count there.
float error_scale(const std::array<glm::vec3, 3>& c, glm::vec3 face, bool instanced)
{
    const glm::vec3 most = glm::max(glm::max(glm::abs(c[0]), glm::abs(c[1])), glm::abs(c[2]));
    // A plane through zero along an axis has no such error, but rays must not start in it.
    constexpr float kLeastPart = 0x1p-12f;
    return instanced ? max_component(most) : std::max(glm::dot(glm::abs(face), most), kLeastPart * max_component(most));
}

/// @param geometric  unit, towards the side that the point is seen from
glm::vec3 shading_normal(const RayInstance& i, const HitTriangle& t, float u, float v, glm::vec3 geometric, bool front)
{
    const glm::vec3 object_normal = (1.0f - u - v) * t.normal[0] + u * t.normal[1] + v * t.normal[2];
    const glm::vec3 smooth = unit_or(i.normal_from_object * object_normal, front ? geometric : -geometric);
    return bend_towards(front ? smooth : -smooth, geometric);
}

}  // namespace

namespace {

RCS_MULTIVERSION
void orient_faces(const HitPacket& packet, const float* nx, const float* ny, const float* nz, FacePacket& faces)
{
    const RayPacket& ray = packet.ray;
    for (int i = 0; i < RayPacket::kWidth; ++i) {
        const float along = nx[i] * ray.direction_x[i] + ny[i] * ray.direction_y[i] + nz[i] * ray.direction_z[i];
        const float length2 = nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i];
        const float unit = (along < 0.0f ? 1.0f : -1.0f) / std::sqrt(length2);
        faces.normal_x[i] = nx[i] * unit;
        faces.normal_y[i] = ny[i] * unit;
        faces.normal_z[i] = nz[i] * unit;
        faces.facing[i] = -along;
        const float height = along * ray.t_max[i];
        const float inverse = height != 0.0f ? 1.0f / height : 0.0f;
        faces.plane_x[i] = nx[i] * inverse;
        faces.plane_y[i] = ny[i] * inverse;
        faces.plane_z[i] = nz[i] * inverse;
    }
}

}  // namespace

void find_faces(const RayScene& rays, const HitPacket& packet, FacePacket& faces)
{
    float nx[RayPacket::kWidth], ny[RayPacket::kWidth], nz[RayPacket::kWidth];
    for (int i = 0; i < RayPacket::kWidth; ++i) {
        nx[i] = packet.normal_x[i];
        ny[i] = packet.normal_y[i];
        nz[i] = packet.normal_z[i];
        if (packet.geometry[i] == RayPacket::kMiss || packet.instance_id[i] == RayPacket::kMiss) continue;
        // Embree gives an instance's normal in object space.
        const glm::vec3 n =
            instance_of(rays, packet.instance_id[i]).normal_from_object * glm::vec3(nx[i], ny[i], nz[i]);
        nx[i] = n.x;
        ny[i] = n.y;
        nz[i] = n.z;
    }
    orient_faces(packet, nx, ny, nz, faces);
    // A face too small for float arithmetic to have a normal: take the one that looks at the ray.
    for (int i = 0; i < RayPacket::kWidth; ++i) {
        const glm::vec3 n(faces.normal_x[i], faces.normal_y[i], faces.normal_z[i]);
        if (packet.geometry[i] == RayPacket::kMiss || std::isfinite(n.x + n.y + n.z)) continue;
        faces.normal_x[i] = -packet.ray.direction_x[i];
        faces.normal_y[i] = -packet.ray.direction_y[i];
        faces.normal_z[i] = -packet.ray.direction_z[i];
        faces.plane_x[i] = faces.plane_y[i] = faces.plane_z[i] = 0.0f;
    }
}

void complete_hit(const RayScene& rays, const HitPacket& packet, int lane, HitSurface& hit)
{
    const RayInstance& i = instance_of(rays, packet.instance(lane));
    const HitTriangle& t = i.triangles[packet.primitive[lane]];
    const float u = packet.u[lane];
    const float v = packet.v[lane];
    hit.point.shading_normal = i.is_curved(packet.primitive[lane])
                                   ? shading_normal(i, t, u, v, hit.point.geometric_normal, hit.point.front)
                                   : hit.point.geometric_normal;
    hit.point.uv = (1.0f - u - v) * t.uv[0] + u * t.uv[1] + v * t.uv[2];
    hit.uv_per_length = t.uv_density() * i.inverse_scale;
}

std::array<glm::vec3, 3> triangle_corners(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive)
{
    const RayInstance& i = instance_of(rays, instance);
    const glm::uvec3 t = i.mesh->triangles[primitive];
    if (!i.instanced) return {i.positions[t.x], i.positions[t.y], i.positions[t.z]};
    const std::vector<glm::vec3>& p = i.mesh->positions;
    return {i.scene_from_object * glm::vec4(p[t.x], 1.0f), i.scene_from_object * glm::vec4(p[t.y], 1.0f),
            i.scene_from_object * glm::vec4(p[t.z], 1.0f)};
}

std::array<glm::vec2, 3> triangle_uvs(const Scene& scene, std::uint32_t instance, std::uint32_t primitive)
{
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[instance].mesh)];
    if (mesh.uvs.empty()) return {};
    const glm::uvec3 t = mesh.triangles[primitive];
    return {mesh.uvs[t.x], mesh.uvs[t.y], mesh.uvs[t.z]};
}

SurfacePoint surface_at(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive, float u, float v,
                        glm::vec3 direction)
{
    const RayInstance& i = instance_of(rays, instance);
    const std::array<glm::vec3, 3> c = triangle_corners(rays, instance, primitive);
    const float w = 1.0f - u - v;
    SurfacePoint point;
    point.position = w * c[0] + u * c[1] + v * c[2];
    point.material = i.material;

    const glm::vec3 face = face_normal(c) * (i.mirrored ? -1.0f : 1.0f);
    point.position_error = kPositionRoundings * kUnitRoundoff * error_scale(c, face, i.instanced);
    point.front = glm::dot(face, direction) < 0.0f;
    point.geometric_normal = point.front ? face : -face;
    point.shading_normal = point.geometric_normal;
    const HitTriangle& t = i.triangles[primitive];
    if (i.is_curved(primitive)) point.shading_normal = shading_normal(i, t, u, v, point.geometric_normal, point.front);
    point.uv = w * t.uv[0] + u * t.uv[1] + v * t.uv[2];
    return point;
}

namespace {

/// Where a ray meets a triangle's plane, and its barycentric weights there, in double precision.
struct PlaneHit {
    double t, u, v;
    glm::dvec3 point;
};

/// A triangle's plane.
struct Plane {
    glm::dvec3 corner, e1, e2, n;
    double nn;

    explicit Plane(const std::array<glm::vec3, 3>& c)
        : corner(c[0]),
          e1(glm::dvec3(c[1]) - corner),
          e2(glm::dvec3(c[2]) - corner),
          n(glm::cross(e1, e2)),
          nn(std::max(glm::dot(n, n), 1e-300))
    {
    }
    PlaneHit meet(const glm::dvec3& origin, const glm::dvec3& direction) const
    {
        const glm::dvec3 s = origin - corner;
        const double slope = glm::dot(n, direction);
        const double t = slope != 0.0 ? -glm::dot(n, s) / slope : 0.0;
        const glm::dvec3 q = s + t * direction;
        return {t, glm::dot(glm::cross(q, e2), n) / nn, glm::dot(glm::cross(e1, q), n) / nn, origin + t * direction};
    }
};

struct PixelHits {
    PlaneHit here, dx, dy;  // through the sample, and one pixel to the right and down
};
PixelHits meet_plane(const std::array<glm::vec3, 3>& c, const CameraRay& ray)
{
    const Plane plane(c);
    return {plane.meet(ray.origin, ray.direction),
            plane.meet(ray.origin + ray.origin_dx, ray.direction + ray.direction_dx),
            plane.meet(ray.origin + ray.origin_dy, ray.direction + ray.direction_dy)};
}

// A pixel on a surface seen at a grazing angle counts as at most so many times larger than one seen squarely:
// cos 89.4 degrees. Beyond, the neighbouring rays may not meet the surface at all.
constexpr double kMostStretch = 100.0;

float footprint(const CameraRay& ray, const PixelHits& hit)
{
    const double t = hit.here.t;
    const double square =
        glm::length(glm::cross(ray.origin_dx + t * ray.direction_dx, ray.origin_dy + t * ray.direction_dy));
    const double area = glm::length(glm::cross(hit.dx.point - hit.here.point, hit.dy.point - hit.here.point));
    return static_cast<float>(std::sqrt(area < square ? square : std::min(area, kMostStretch * square)));
}

}  // namespace

double pixels_inside(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive, const CameraRay& ray)
{
    const PixelHits hit = meet_plane(triangle_corners(rays, instance, primitive), ray);
    if (!(hit.here.t > 0.0)) return -std::numeric_limits<double>::infinity();
    const auto distance = [](double here, double dx, double dy) {
        const double change = std::sqrt((dx - here) * (dx - here) + (dy - here) * (dy - here));
        return change > 0.0 ? here / change : -std::numeric_limits<double>::infinity();
    };
    const auto w = [](const PlaneHit& h) { return 1.0 - h.u - h.v; };
    return std::min({distance(hit.here.u, hit.dx.u, hit.dy.u), distance(hit.here.v, hit.dx.v, hit.dy.v),
                     distance(w(hit.here), w(hit.dx), w(hit.dy))});
}

std::optional<Hit> find_visible(const RayScene& rays, const CameraRay& camera_ray, float after)
{
    Ray ray{glm::vec3(camera_ray.origin), glm::vec3(camera_ray.direction)};
    if (after > 0.0f) ray.t_min = std::nextafter(after, ray.t_max);
    while (const std::optional<Hit> hit = intersect(rays, ray, RayFilter::everything)) {
        const SurfacePoint point = surface_at(rays, hit->instance, hit->primitive, hit->u, hit->v, ray.direction);
        if (camera_sees(rays.scene().materials[static_cast<std::size_t>(point.material)], point.front)) return hit;
        ray.t_min = std::nextafter(hit->t, ray.t_max);
    }
    return std::nullopt;
}

VisiblePoint visible_point(const RayScene& rays, std::uint32_t instance, std::uint32_t primitive, const CameraRay& ray,
                           glm::dvec3 camera_position, float texture_scale)
{
    const std::array<glm::vec3, 3> c = triangle_corners(rays, instance, primitive);
    const PixelHits pixel = meet_plane(c, ray);
    const PlaneHit& hit = pixel.here;

    VisiblePoint point;
    // A sample on the triangle's edge may lie outside it by a rounding.
    const double u = std::clamp(hit.u, 0.0, 1.0);
    const double v = std::clamp(hit.v, 0.0, 1.0 - u);
    point.surface =
        surface_at(rays, instance, primitive, static_cast<float>(u), static_cast<float>(v), glm::vec3(ray.direction));
    const glm::dvec3 position = (1.0 - u - v) * glm::dvec3(c[0]) + u * glm::dvec3(c[1]) + v * glm::dvec3(c[2]);
    point.relative_position = glm::vec3(position - camera_position);
    // Kept relative to the camera the position is rounded once more.
    point.surface.position_error +=
        kPositionRoundings * kUnitRoundoff *
        glm::dot(glm::abs(point.surface.geometric_normal), glm::abs(point.relative_position));
    point.distance = hit.t * glm::length(ray.direction);
    point.footprint = footprint(ray, pixel);

    const std::array<glm::vec2, 3> uv = triangle_uvs(rays.scene(), instance, primitive);
    const auto moved = [&](const PlaneHit& h) {
        return texture_scale *
               (static_cast<float>(h.u - hit.u) * (uv[1] - uv[0]) + static_cast<float>(h.v - hit.v) * (uv[2] - uv[0]));
    };
    const glm::vec3 outgoing = -glm::vec3(glm::normalize(ray.direction));
    const Hit at{static_cast<float>(hit.t), static_cast<float>(u), static_cast<float>(v), instance, primitive};
    point.material = material_at(rays, at, point.surface, outgoing, {moved(pixel.dx), moved(pixel.dy)});
    point.albedo = albedo(point.material.bsdf, outgoing, diffuse_lobes(point.material.bsdf));
    point.emission = point.material.emission;
    return point;
}

}  // namespace rcs
