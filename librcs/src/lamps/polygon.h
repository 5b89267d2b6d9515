#pragma once

#include <cstddef>

#include <glm/glm.hpp>

namespace rcs {

/// Irradiance that a polygon of uniform radiance 1 sends to a point: the integral of the cosine to
/// `normal` over the directions in which the polygon is seen above the horizon, in [0, pi] [sr].
/// Lambert's formula; either winding. Lengths between 1e-9 and 1e9 m. Finite for every input in
/// that range: 0 for a polygon without area or below the horizon.
/// @param corners  of a planar convex polygon, relative to the point
/// @param count  in [3, 8]
/// @param normal  of the receiver, unit
float polygon_irradiance_factor(const glm::vec3* corners, int count, glm::vec3 normal);

/// The part of a convex polygon above the plane through the point (Sutherland and Hodgman 1974).
/// @param corners  relative to the point   @param count  in [3, 8]   @param clipped  room for one corner more
/// @return its number of corners, 0 if all is below
int clip_to_horizon(const glm::vec3* corners, int count, glm::vec3 normal, glm::vec3* clipped);

/// A triangle as a point sees it, prepared for sampling uniformly in solid angle. Relative to the point.
struct SphericalTriangle {
    glm::dvec3 corner[3];    ///< [m]
    glm::dvec3 normal;       ///< cross product of the first two edges; twice the area long [m^2]
    glm::dvec3 a, b;         ///< unit directions to the first two corners
    glm::dvec3 tangent_ac;   ///< unit, at a right angle to a, towards the third corner
    double sin_alpha = 0.0;  ///< of the angle at a
    double cos_alpha = 0.0;
    double tan_half_c = 0.0;   ///< c is the side from a to b
    double solid_angle = 0.0;  ///< [sr], in [0, 2 pi]
    bool by_area = false;      ///< too small or degenerate on the sphere: sampled by area instead
};
SphericalTriangle make_spherical_triangle(const glm::vec3 corners[3]);

struct TriangleSample {
    glm::vec3 position;     ///< on the triangle, relative to the point [m]
    float inverse_density;  ///< 1 / probability density in solid angle [sr]; finite, may be 0
};
/// Maps the unit square to the triangle: uniform in solid angle (Arvo 1995, "Stratified sampling of
/// spherical triangles"), or in area where `by_area` is set.
TriangleSample sample(const SphericalTriangle& triangle, float u1, float u2);

/// Some points of the square and their places, lane by lane.
struct TriangleLanes {
    static constexpr std::size_t kWidth = 16;

    float u1[kWidth] = {}, u2[kWidth] = {};
    float x[kWidth], y[kWidth], z[kWidth], inverse_density[kWidth];

    TriangleSample operator[](std::size_t lane) const { return {{x[lane], y[lane], z[lane]}, inverse_density[lane]}; }
    void set(std::size_t lane, const TriangleSample& sample)
    {
        x[lane] = sample.position.x;
        y[lane] = sample.position.y;
        z[lane] = sample.position.z;
        inverse_density[lane] = sample.inverse_density;
    }
};
/// The same of the first `count` lanes.
void sample(const SphericalTriangle& triangle, std::size_t count, TriangleLanes& lanes);

}  // namespace rcs
