#include "reference/lamp_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reference/sobol.h"

namespace rcs {

glm::vec2 PathPoints::pair(int n) const
{
    return sobol_pair(index, mix64(key ^ static_cast<std::uint64_t>(n)));
}

namespace {

float sum_of_channels(glm::vec3 color) { return color.r + color.g + color.b; }

/// Whether the side of the triangle that emits faces the point.
bool shines_on(const EmissiveTriangle& triangle, glm::vec3 position)
{
    return triangle.double_sided || glm::dot(position - triangle.corner[0], triangle.normal) > 0.0f;
}

std::array<glm::vec3, 3> corners_from(const EmissiveTriangle& triangle, glm::vec3 position)
{
    return {triangle.corner[0] - position, triangle.corner[1] - position, triangle.corner[2] - position};
}

/// Up to this many triangles the exact unoccluded irradiance is worth its price (50 ns each,
/// a ray some 500); beyond, an estimate from power and distance does.
constexpr std::size_t kMaxExactTriangles = 64;

float triangle_weight(const EmissiveTriangle& triangle, const SurfacePoint& point, bool exact)
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

bool lit_from(const RayScene& rays, const SurfacePoint& point, const PunctualSample& lamp)
{
    return !occluded(rays, ray_from(point, lamp.to_light, lamp.distance));
}

/// The segment to a lamp's sample point stops short of the lamp by the rounding error of its corners:
/// its end is lifted off the lamp's plane, so that grazing light is cut no sooner than other light.
bool sees_sample(const RayScene& rays, const SurfacePoint& point, const EmissiveTriangle& triangle,
                 glm::vec3 to_sample)
{
    const glm::vec3 target = point.position + to_sample;
    const glm::vec3 size =
        glm::max(glm::abs(triangle.corner[0]), glm::max(glm::abs(target), glm::abs(point.position)));
    constexpr float kRounding = 0x1p-20f;  // 8 units in the last place of a coordinate
    const float lift = kRounding * glm::max(size.x, glm::max(size.y, size.z)) + point.position_error;
    const float side = glm::dot(to_sample, triangle.normal) < 0.0f ? lift : -lift;

    Ray ray = ray_from(point, to_sample, 1.0f);
    ray.direction = target + side * triangle.normal - ray.origin;
    return !occluded(rays, ray);
}

glm::vec3 sample_triangle(const RayScene& rays, const EmissiveTriangle& triangle, const SurfacePoint& point,
                          glm::vec2 u)
{
    const auto corners = corners_from(triangle, point.position);
    const TriangleSample s = sample(make_spherical_triangle(corners.data()), u.x, u.y);
    const float distance = glm::length(s.position);
    if (!(distance > 0.0f)) return glm::vec3(0.0f);
    const float cosine = receiving_cosine(point, s.position / distance);
    const glm::vec3 irradiance = triangle.radiance * (cosine * s.inverse_density);
    if (irradiance == glm::vec3(0.0f)) return irradiance;
    return sees_sample(rays, point, triangle, s.position) ? irradiance : glm::vec3(0.0f);
}

}  // namespace

void weigh_lamps(const Lights& lights, const SurfacePoint& point, Lamps which, LampsAtPoint& result)
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
        for (const PunctualLamp& light : lights.punctual) {
            PunctualSample lamp = sample_punctual(light, point.position);
            lamp.irradiance *= receiving_cosine(point, lamp.to_light);
            if (add(sum_of_channels(lamp.irradiance))) result.punctual.push_back(lamp);
        }
    }
    const bool exact = lights.triangles.size() <= kMaxExactTriangles;
    for (std::size_t i = 0; i < lights.triangles.size(); ++i) {
        if (add(triangle_weight(lights.triangles[i], point, exact)))
            result.triangles.push_back(static_cast<std::uint32_t>(i));
    }
}

glm::vec3 sample_lamp(const RayScene& rays, const Lights& lights, const SurfacePoint& point,
                      const LampsAtPoint& lamps, const PathPoints& points, int n)
{
    if (lamps.cumulative.empty()) return glm::vec3(0.0f);
    if (lamps.punctual.size() == 1 && lamps.triangles.empty()) {
        const PunctualSample& lamp = lamps.punctual.front();
        return lit_from(rays, point, lamp) ? lamp.irradiance : glm::vec3(0.0f);
    }

    glm::vec2 u = points.pair(n);
    const float total = lamps.cumulative.back();
    const auto found = std::upper_bound(lamps.cumulative.begin(), lamps.cumulative.end(), u.x * total);
    const auto chosen = std::min<std::size_t>(static_cast<std::size_t>(found - lamps.cumulative.begin()),
                                              lamps.cumulative.size() - 1);
    const float below = chosen > 0 ? lamps.cumulative[chosen - 1] : 0.0f;
    const float weight = lamps.cumulative[chosen] - below;
    // What is left of u.x within the chosen lamp's share is as well spread as u.x itself.
    u.x = glm::clamp((u.x * total - below) / weight, 0.0f, 0x1.fffffep-1f);

    glm::vec3 irradiance(0.0f);
    if (chosen < lamps.punctual.size()) {
        const PunctualSample& lamp = lamps.punctual[chosen];
        if (lit_from(rays, point, lamp)) irradiance = lamp.irradiance;
    } else {
        const std::uint32_t triangle = lamps.triangles[chosen - lamps.punctual.size()];
        irradiance = sample_triangle(rays, lights.triangles[triangle], point, u);
    }
    return irradiance * (total / weight);
}

glm::vec3 punctual_irradiance(const RayScene& rays, const Lights& lights, const SurfacePoint& point)
{
    glm::vec3 sum(0.0f);
    for (const PunctualLamp& light : lights.punctual) {
        const PunctualSample lamp = sample_punctual(light, point.position);
        const glm::vec3 irradiance = lamp.irradiance * receiving_cosine(point, lamp.to_light);
        if (irradiance != glm::vec3(0.0f) && lit_from(rays, point, lamp)) sum += irradiance;
    }
    return sum;
}

}  // namespace rcs
