#include "lamps/polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "util/multiversion.h"

namespace rcs {
namespace {

constexpr int kMaxCorners = 8;

/// The angle in [0, pi] whose sine and cosine are proportional to s >= 0 and c, to 1e-7 of itself.
/// Polynomial: Abramowitz and Stegun 1964, 4.4.49.
float angle_of(float s, float c)
{
    const float abs_c = std::abs(c);
    const float larger = std::max(s, abs_c);
    if (larger == 0.0f) return 0.0f;
    const float t = std::min(s, abs_c) / larger;
    const float t2 = t * t;
    float p = 0.0028662257f;
    p = p * t2 - 0.0161657367f;
    p = p * t2 + 0.0429096138f;
    p = p * t2 - 0.0752896400f;
    p = p * t2 + 0.1065626393f;
    p = p * t2 - 0.1420889944f;
    p = p * t2 + 0.1999355085f;
    p = p * t2 - 0.3333314528f;
    p = (p * t2 + 1.0f) * t;
    constexpr float kPi = std::numbers::pi_v<float>;
    const float acute = s > abs_c ? 0.5f * kPi - p : p;
    return c < 0.0f ? kPi - acute : acute;
}

/// Twice Lambert's term of the edge a-b. The cross product is taken with the edge, not with b: for a
/// short edge that keeps the digits which cross(a, b) would cancel.
float edge_term(glm::vec3 a, glm::vec3 b, glm::vec3 normal)
{
    const glm::vec3 c = glm::cross(a, b - a);
    const float length = std::sqrt(glm::dot(c, c));
    if (!(length > 0.0f)) return 0.0f;  // the point lies on the edge's line
    return angle_of(length, glm::dot(a, b)) * glm::dot(normal, c) / length;
}

/// The same in double precision.
double precise_edge_term(glm::dvec3 a, glm::dvec3 b, glm::dvec3 normal)
{
    const glm::dvec3 c = glm::cross(a, b - a);
    const double length = glm::length(c);
    return length > 0.0 ? std::atan2(length, glm::dot(a, b)) * glm::dot(normal, c) / length : 0.0;
}

}  // namespace

int clip_to_horizon(const glm::vec3* corners, int count, glm::vec3 normal, glm::vec3* clipped)
{
    float heights[kMaxCorners];
    bool any_above = false;
    for (int i = 0; i < count; ++i) {
        heights[i] = glm::dot(corners[i], normal);
        any_above |= heights[i] > 0.0f;
    }
    if (!any_above) return 0;
    int kept = 0;
    for (int i = 0; i < count; ++i) {
        const int next = i + 1 < count ? i + 1 : 0;
        if (heights[i] >= 0.0f) clipped[kept++] = corners[i];
        if ((heights[i] > 0.0f && heights[next] < 0.0f) || (heights[i] < 0.0f && heights[next] > 0.0f)) {
            const float t = heights[i] / (heights[i] - heights[next]);
            clipped[kept++] = corners[i] + (corners[next] - corners[i]) * t;
        }
    }
    return kept;
}

float polygon_irradiance_factor(const glm::vec3* corners, int count, glm::vec3 normal)
{
    glm::vec3 clipped[2 * kMaxCorners];
    count = clip_to_horizon(corners, count, normal, clipped);
    const auto next = [&](int i) { return clipped[i + 1 < count ? i + 1 : 0]; };
    float sum = 0.0f, size = 0.0f;
    for (int i = 0; i < count; ++i) {
        const float term = edge_term(clipped[i], next(i), normal);
        sum += term;
        size += std::abs(term);
    }
    // Edges of a polygon that is seen at a grazing angle, or far away, cancel each other but for little.
    constexpr float kFewDigits = 0x1p-12f;
    if (std::abs(sum) < kFewDigits * size) {
        double precise = 0.0;
        for (int i = 0; i < count; ++i) precise += precise_edge_term(clipped[i], next(i), normal);
        sum = static_cast<float>(precise);
    }
    return std::min(0.5f * std::abs(sum), std::numbers::pi_v<float>);
}

SphericalTriangle make_spherical_triangle(const glm::vec3 corners[3])
{
    SphericalTriangle t;
    for (int i = 0; i < 3; ++i) t.corner[i] = glm::dvec3(corners[i]);
    const glm::dvec3 ab = t.corner[1] - t.corner[0];
    const glm::dvec3 ac = t.corner[2] - t.corner[0];
    t.normal = glm::cross(ab, ac);

    const double la = glm::length(t.corner[0]);
    const double lb = glm::length(t.corner[1]);
    const double lc = glm::length(t.corner[2]);
    t.by_area = true;
    if (!(la > 0.0 && lb > 0.0 && lc > 0.0)) return t;

    t.a = t.corner[0] / la;
    t.b = t.corner[1] / lb;
    const glm::dvec3 c = t.corner[2] / lc;
    // Van Oosterom and Strackee 1983: tan(solid angle / 2) = [a b c] / (1 + ab + bc + ca).
    const double triple = std::abs(glm::dot(t.corner[0], t.normal)) / (la * lb * lc);
    const double dot_ab = glm::dot(t.a, t.b);
    t.solid_angle = 2.0 * std::atan2(triple, 1.0 + dot_ab + glm::dot(t.b, c) + glm::dot(c, t.a));

    // Cross products with edges: exact to rounding also for short edges.
    const glm::dvec3 a_cross_b = glm::cross(t.a, ab) / lb;
    const glm::dvec3 a_cross_c = glm::cross(t.a, ac) / lc;
    const double sin_c = glm::length(a_cross_b);
    const double sin_b = glm::length(a_cross_c);
    // Below 1e-10 sr (sides of 1e-5 rad) area and solid angle are the same to 1e-5 unless seen at a
    // grazing angle; up there the point nearly touches the triangle. 1e-12: still four digits in the
    // cross products of double-precision unit vectors.
    constexpr double kMinSolidAngle = 1e-10;
    constexpr double kMinSine = 1e-12;
    if (t.solid_angle < kMinSolidAngle || sin_b < kMinSine || sin_c < kMinSine) return t;

    t.sin_alpha = triple / (sin_b * sin_c);
    t.cos_alpha = glm::dot(a_cross_b, a_cross_c) / (sin_b * sin_c);
    t.tan_half_c = sin_c / (1.0 + dot_ab);
    t.tangent_ac = glm::cross(a_cross_c, t.a) / sin_b;
    t.by_area = !(t.tan_half_c < 1.0 / kMinSine);
    return t;
}

namespace {

TriangleSample sample_area(const SphericalTriangle& t, double u1, double u2)
{
    const double root = std::sqrt(u1);
    const glm::dvec3 on_side = (1.0 - u2) * t.corner[1] + u2 * t.corner[2];
    const glm::dvec3 p = (1.0 - root) * t.corner[0] + root * on_side;
    const double distance2 = glm::dot(p, p);
    if (!(distance2 > 0.0)) return {glm::vec3(p), 0.0f};
    // area cos(angle at the triangle) / distance^2; |normal| is twice the area.
    const double inverse_density = 0.5 * std::abs(glm::dot(t.normal, p)) / (distance2 * std::sqrt(distance2));
    constexpr double kWithinFloat = 1e30;
    return {glm::vec3(p), static_cast<float>(std::min(inverse_density, kWithinFloat))};
}

/// Arvo's first step cuts off a share u1 of the area by an arc from b to a point c1 on the side ac.
/// His cos(side) cancels for small triangles; the half-angle formula of the spherical excess E,
///   tan(E/2) = x k sin(alpha) / (1 + x k cos(alpha)),  x = tan(side/2), k = tan(c/2),
/// solved for x does not. Second step: a point on the arc from b to c1, uniform in 1 - cos(angle to b).
/// @param sine, cosine  of E/2
/// @return how far that way the triangle's plane is, over `direction`
RCS_ALWAYS_INLINE double distance_towards(const SphericalTriangle& t, double sine, double cosine, double u2,
                                          glm::dvec3& direction)
{
    // sin(alpha - E/2), positive; the floor is for rounding in a needle.
    const double remaining = std::max(t.sin_alpha * cosine - t.cos_alpha * sine, 1e-300);
    const double x = sine / (t.tan_half_c * remaining);
    const double inverse = 1.0 / (1.0 + x * x);
    const glm::dvec3 c1 = ((1.0 - x * x) * inverse) * t.a + (2.0 * x * inverse) * t.tangent_ac;

    const glm::dvec3 chord = c1 - t.b;
    const double rise = 0.5 * u2 * glm::dot(chord, chord);
    const glm::dvec3 sideways = chord - glm::dot(chord, t.b) * t.b;
    const double length = std::sqrt(glm::dot(sideways, sideways));
    const double part = std::sqrt(std::max(0.0, rise * (2.0 - rise))) / length;
    direction = (1.0 - rise) * t.b + (length > 0.0 ? part : 0.0) * sideways;
    return glm::dot(t.normal, t.corner[0]) / glm::dot(t.normal, direction);
}

/// At a corner seen edge-on, rounding may turn the direction out of the plane's front.
bool is_in_front(double distance) { return distance > 0.0 && distance <= std::numeric_limits<double>::max(); }

RCS_MULTIVERSION
void sample_solid_angle(const SphericalTriangle& triangle, const double* sine, const double* cosine, double* distance,
                        TriangleLanes& lanes)
{
    const SphericalTriangle t = triangle;
    const float inverse_density = static_cast<float>(t.solid_angle);
    RCS_INDEPENDENT_LOOP
    for (std::size_t i = 0; i < TriangleLanes::kWidth; ++i) {
        glm::dvec3 direction;
        const double away = distance_towards(t, sine[i], cosine[i], static_cast<double>(lanes.u2[i]), direction);
        distance[i] = away;
        lanes.x[i] = static_cast<float>(direction.x * away);
        lanes.y[i] = static_cast<float>(direction.y * away);
        lanes.z[i] = static_cast<float>(direction.z * away);
        lanes.inverse_density[i] = inverse_density;
    }
}

}  // namespace

TriangleSample sample(const SphericalTriangle& t, float u1, float u2)
{
    if (t.by_area) return sample_area(t, u1, u2);
    const double half_excess = 0.5 * static_cast<double>(u1) * t.solid_angle;
    glm::dvec3 direction;
    const double distance =
        distance_towards(t, std::sin(half_excess), std::cos(half_excess), static_cast<double>(u2), direction);
    if (!is_in_front(distance)) return sample_area(t, u1, u2);
    return {glm::vec3(direction * distance), static_cast<float>(t.solid_angle)};
}

void sample(const SphericalTriangle& t, std::size_t count, TriangleLanes& lanes)
{
    double sine[TriangleLanes::kWidth] = {}, cosine[TriangleLanes::kWidth] = {}, distance[TriangleLanes::kWidth] = {};
    if (!t.by_area) {
        for (std::size_t i = 0; i < count; ++i) {
            const double half_excess = 0.5 * static_cast<double>(lanes.u1[i]) * t.solid_angle;
            sine[i] = std::sin(half_excess);
            cosine[i] = std::cos(half_excess);
        }
        sample_solid_angle(t, sine, cosine, distance, lanes);
    }
    for (std::size_t i = 0; i < count; ++i)
        if (!is_in_front(distance[i])) lanes.set(i, sample_area(t, lanes.u1[i], lanes.u2[i]));
}

}  // namespace rcs
