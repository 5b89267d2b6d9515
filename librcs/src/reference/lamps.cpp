#include "reference/lamps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lamps/polygon.h"
#include "rays/surface_material.h"
#include "reference/passage.h"

namespace rcs {
namespace {

constexpr float kBelowOne = 0x1.fffffep-1f;

float sum_of_channels(glm::vec3 color) { return color.r + color.g + color.b; }

/// Whether the side of the triangle that emits faces the point.
bool shines_on(const LampTriangle& triangle, glm::vec3 position)
{
    return triangle.double_sided || glm::dot(position - triangle.corner[0], triangle.normal) > 0.0f;
}

std::array<glm::vec3, 3> corners_from(const LampTriangle& triangle, glm::vec3 position)
{
    return {triangle.corner[0] - position, triangle.corner[1] - position, triangle.corner[2] - position};
}

/// Up to this many triangles the exact unoccluded irradiance is worth its price (50 ns each,
/// a ray some 500); beyond, an estimate from power and distance does.
constexpr std::size_t kMaxExactTriangles = 64;

float triangle_weight(const LampTriangle& triangle, const SurfacePoint& point, bool exact)
{
    if (!shines_on(triangle, point.position)) return 0.0f;
    const auto corners = corners_from(triangle, point.position);
    const float power = sum_of_channels(triangle.radiance);
    if (exact) return power * polygon_irradiance_factor(corners.data(), 3, point.shading_normal);

    const auto above = [&](glm::vec3 corner) { return glm::dot(corner, point.shading_normal) > 0.0f; };
    if (std::none_of(corners.begin(), corners.end(), above)) return 0.0f;
    const glm::vec3 centre = (corners[0] + corners[1] + corners[2]) / 3.0f;
    // The area keeps the weight of a near one within bounds, as the solid angle does.
    return power * triangle.area / (glm::dot(centre, centre) + triangle.area);
}

/// The segment to a lamp's sample point stops short of the lamp by the rounding error of its corners:
/// its end is lifted off the lamp's plane, so that grazing light is cut no sooner than other light.
glm::vec3 seen_of_sample(const RayScene& rays, const SurfacePoint& point, const LampTriangle& triangle,
                         glm::vec3 to_sample)
{
    const glm::vec3 target = point.position + to_sample;
    const glm::vec3 size = glm::max(glm::abs(triangle.corner[0]), glm::max(glm::abs(target), glm::abs(point.position)));
    constexpr float kRounding = 0x1p-20f;  // 8 units in the last place of a coordinate
    const float lift = kRounding * glm::max(size.x, glm::max(size.y, size.z)) + point.position_error;
    const float side = glm::dot(to_sample, triangle.normal) < 0.0f ? lift : -lift;

    Ray ray = ray_from(point, to_sample, 1.0f);
    ray.direction = target + side * triangle.normal - ray.origin;
    return transmitted_along(rays, ray);
}

/// Emission of a textured triangle where a direction meets it, times its coverage there.
glm::vec3 textured_radiance(const RayScene& rays, const LampTriangle& triangle, glm::vec3 target, glm::vec3 direction)
{
    const glm::dvec3 e1 = glm::dvec3(triangle.corner[1]) - glm::dvec3(triangle.corner[0]);
    const glm::dvec3 e2 = glm::dvec3(triangle.corner[2]) - glm::dvec3(triangle.corner[0]);
    const glm::dvec3 n = glm::cross(e1, e2), p = glm::dvec3(target) - glm::dvec3(triangle.corner[0]);
    const double area2 = glm::dot(n, n);
    const float u = std::clamp(static_cast<float>(glm::dot(glm::cross(p, e2), n) / area2), 0.0f, 1.0f);
    const float v = std::clamp(static_cast<float>(glm::dot(glm::cross(e1, p), n) / area2), 0.0f, 1.0f - u);
    const SurfacePoint point = surface_at(rays, triangle.instance, triangle.primitive, u, v, direction);
    const Hit hit{0.0f, u, v, triangle.instance, triangle.primitive};
    const MaterialValues values = material_at(rays, hit, point, -direction, {});
    return values.alpha * values.emission;
}

LampSample sample_triangle(const RayScene& rays, const LampTriangle& triangle, const SurfacePoint& point, glm::vec2 u)
{
    if (!shines_on(triangle, point.position)) return {};
    const auto corners = corners_from(triangle, point.position);
    const TriangleSample s = sample(make_spherical_triangle(corners.data()), u.x, u.y);
    const float distance = glm::length(s.position);
    if (!(distance > 0.0f) || !(s.inverse_density > 0.0f)) return {};
    LampSample result;
    result.direction = s.position / distance;
    if (receiving_cosine(point, result.direction) <= 0.0f) return {};
    result.density = 1.0f / s.inverse_density;
    const glm::vec3 radiance = triangle.textured
                                   ? textured_radiance(rays, triangle, point.position + s.position, result.direction)
                                   : triangle.radiance;
    if (radiance == glm::vec3(0.0f)) return {};
    result.light = radiance * s.inverse_density * seen_of_sample(rays, point, triangle, s.position);
    return result;
}

/// Density of sampling one triangle uniformly in solid angle, or by area where that is how it is sampled.
float triangle_density(const LampTriangle& triangle, const SurfacePoint& point, glm::vec3 direction)
{
    const auto corners = corners_from(triangle, point.position);
    const SphericalTriangle s = make_spherical_triangle(corners.data());
    if (!s.by_area) return s.solid_angle > 0.0 ? static_cast<float>(1.0 / s.solid_angle) : 0.0f;
    const float height = std::abs(glm::dot(corners[0], triangle.normal));
    const float cosine = std::abs(glm::dot(direction, triangle.normal));
    return cosine > 0.0f ? height * height / (cosine * cosine * cosine * triangle.area) : 0.0f;
}

double power_below(const LampList& lamps, std::size_t triangle)
{
    return triangle > 0 ? lamps.power[triangle - 1] : 0.0;
}

/// @param u  becomes what is left of it within the chosen triangle's share
std::size_t choose_by_power(const LampList& lamps, float& u)
{
    const double target = static_cast<double>(u) * lamps.power.back();
    const auto found = std::upper_bound(lamps.power.begin(), lamps.power.end() - 1, target);
    const auto i = static_cast<std::size_t>(found - lamps.power.begin());
    const double below = power_below(lamps, i);
    u = std::clamp(static_cast<float>((target - below) / (lamps.power[i] - below)), 0.0f, kBelowOne);
    return i;
}

}  // namespace

LampList list_lamps(const RayScene& rays)
{
    const Scene& scene = rays.scene();
    LampList lamps;
    lamps.punctual.assign(scene.lights.begin(), scene.lights.end());
    lamps.triangle_of.resize(scene.instances.size());
    double sum = 0.0;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.instances[i].mesh)];
        const Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
        if (material.emission == glm::vec3(0.0f) || material.unlit) continue;
        lamps.triangle_of[i].assign(mesh.triangles.size(), LampList::kNone);
        for (std::uint32_t primitive = 0; primitive < mesh.triangles.size(); ++primitive) {
            const auto corners = triangle_corners(rays, i, primitive);
            const glm::dvec3 cross = glm::cross(glm::dvec3(corners[1]) - glm::dvec3(corners[0]),
                                                glm::dvec3(corners[2]) - glm::dvec3(corners[0]));
            LampTriangle t{};
            t.area = static_cast<float>(0.5 * glm::length(cross));
            if (!(t.area > 0.0f)) continue;
            std::copy(corners.begin(), corners.end(), t.corner);
            t.normal = glm::vec3(glm::normalize(cross));
            // Which side is the front is asked of what rays see: mirrored instances turn it.
            constexpr float kThird = 1.0f / 3.0f;
            if (!surface_at(rays, i, primitive, kThird, kThird, -t.normal).front) t.normal = -t.normal;
            t.radiance = material.emission;
            t.instance = i;
            t.primitive = primitive;
            t.double_sided = material.double_sided;
            t.textured = material.emission_texture.used() || material.alpha_mode != AlphaMode::opaque;
            lamps.triangle_of[i][primitive] = static_cast<std::uint32_t>(lamps.triangles.size());
            lamps.triangles.push_back(t);
            sum += static_cast<double>(sum_of_channels(t.radiance) * t.area);
            lamps.power.push_back(sum);
        }
    }
    return lamps;
}

void weigh_lamps(const LampList& lamps, const SurfacePoint& point, Lamps which, LampsAtPoint& result)
{
    result.punctual.clear();
    result.triangles.clear();
    result.cumulative.clear();
    float total = 0.0f;
    const auto add = [&](float weight) {
        if (!(total + weight > total)) return false;  // no share of its own after rounding
        result.cumulative.push_back(total += weight);
        return true;
    };
    if (which == Lamps::all) {
        for (const PunctualLamp& light : lamps.punctual) {
            const PunctualSample lamp = sample_punctual(light, point.position);
            if (add(sum_of_channels(lamp.irradiance) * receiving_cosine(point, lamp.to_light)))
                result.punctual.push_back(lamp);
        }
    }
    if (!lamps.weighs_triangles()) {
        add(total > 0.0f ? total : 1.0f);  // as often as all punctual lamps together
        return;
    }
    const bool exact = lamps.triangles.size() <= kMaxExactTriangles;
    for (std::size_t i = 0; i < lamps.triangles.size(); ++i) {
        if (add(triangle_weight(lamps.triangles[i], point, exact)))
            result.triangles.push_back(static_cast<std::uint32_t>(i));
    }
}

LampSample sample_lamp(const RayScene& rays, const LampList& lamps, const SurfacePoint& point,
                       const LampsAtPoint& weights, glm::vec2 u)
{
    if (weights.cumulative.empty()) return {};
    const float total = weights.cumulative.back();
    const auto found = std::upper_bound(weights.cumulative.begin(), weights.cumulative.end(), u.x * total);
    const auto chosen = std::min<std::size_t>(static_cast<std::size_t>(found - weights.cumulative.begin()),
                                              weights.cumulative.size() - 1);
    const float below = chosen > 0 ? weights.cumulative[chosen - 1] : 0.0f;
    float chance = (weights.cumulative[chosen] - below) / total;
    // What is left of u.x within the chosen lamp's share is as well spread as u.x itself.
    u.x = glm::clamp((u.x * total - below) / (chance * total), 0.0f, kBelowOne);

    LampSample result;
    if (chosen < weights.punctual.size()) {
        const PunctualSample& lamp = weights.punctual[chosen];
        result.direction = lamp.to_light;
        result.light = punctual_light(rays, point, lamp);
    } else {
        std::size_t triangle = 0;
        if (lamps.weighs_triangles()) {
            triangle = weights.triangles[chosen - weights.punctual.size()];
        } else {
            triangle = choose_by_power(lamps, u.x);
            chance *= static_cast<float>((lamps.power[triangle] - power_below(lamps, triangle)) / lamps.power.back());
        }
        result = sample_triangle(rays, lamps.triangles[triangle], point, u);
    }
    result.light /= chance;
    result.density *= chance;
    return result;
}

float lamp_density(const LampList& lamps, const LampsAtPoint& weights, const SurfacePoint& point, const Hit& hit,
                   glm::vec3 direction)
{
    const std::vector<std::uint32_t>& of_primitive = lamps.triangle_of[hit.instance];
    if (of_primitive.empty() || weights.cumulative.empty()) return 0.0f;
    const std::uint32_t triangle = of_primitive[hit.primitive];
    if (triangle == LampList::kNone || !shines_on(lamps.triangles[triangle], point.position)) return 0.0f;
    const std::vector<float>& c = weights.cumulative;
    std::size_t entry = weights.punctual.size();
    float share = 1.0f;
    if (lamps.weighs_triangles()) {
        const auto found = std::lower_bound(weights.triangles.begin(), weights.triangles.end(), triangle);
        if (found == weights.triangles.end() || *found != triangle) return 0.0f;
        entry += static_cast<std::size_t>(found - weights.triangles.begin());
    } else {
        share = static_cast<float>((lamps.power[triangle] - power_below(lamps, triangle)) / lamps.power.back());
    }
    const float weight = c[entry] - (entry > 0 ? c[entry - 1] : 0.0f);
    return share * weight / c.back() * triangle_density(lamps.triangles[triangle], point, direction);
}

glm::vec3 punctual_light(const RayScene& rays, const SurfacePoint& point, const PunctualSample& lamp)
{
    return lamp.irradiance * transmitted_along(rays, ray_from(point, lamp.to_light, lamp.distance));
}

}  // namespace rcs
