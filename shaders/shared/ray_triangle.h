// Where a ray meets a triangle: the one definition that C++ and GLSL compile, in the way of Embree's robust mode.
#ifdef __cplusplus
#pragma once
#endif
#include "shared/language.h"
#ifdef __cplusplus
namespace rcs {
namespace gpu {
#endif

// On which side of the edge from a to b (from the ray's origin) the ray passes, in the sense of Pluecker coordinates.
// The edge from b to a has exactly the negative of it: no ray slips through between two triangles that share it.
RCS_SHARED_FUNCTION float rcs_edge_side(vec3 a, vec3 b, vec3 d)
{
    RCS_PRECISE float ex = b.x - a.x, ey = b.y - a.y, ez = b.z - a.z;
    RCS_PRECISE float sx = b.x + a.x, sy = b.y + a.y, sz = b.z + a.z;
    RCS_PRECISE float cx = ey * sz - ez * sy, cy = ez * sx - ex * sz, cz = ex * sy - ey * sx;
    RCS_PRECISE float side = cx * d.x + cy * d.y + cz * d.z;
    return side;
}

// One component of a triangle's normal, (a x b) or the equal (b x c), whichever loses fewer digits.
// @param a1, a2  the two other components of edge a, and so on
RCS_SHARED_FUNCTION float rcs_normal_component(float a1, float a2, float b1, float b2, float c1, float c2)
{
    RCS_PRECISE float ab = a2 * b1, bc = b2 * c1;
    RCS_PRECISE float of_ab = a1 * b2 - ab, of_bc = b1 * c2 - bc;
    return abs(ab) < abs(bc) ? of_ab : of_bc;
}

// Of a vector, the largest component.
RCS_SHARED_FUNCTION float rcs_extent(vec3 a) { return max(max(abs(a.x), abs(a.y)), abs(a.z)); }

// What a ray's line has to do with a triangle.
struct RcsMeeting {
    bool meets;    // it passes inside, on either side; on an edge it meets both triangles
    bool near;     // it passes inside, or so close outside that other roundings would have it inside
    bool doubted;  // other roundings would have it the other way
    vec3 normal;   // counter-clockwise, not unit
    float t;       // distance in units of d
    float t_room;  // what other roundings would make of that, at most; infinite where the line lies in the plane
    float u, v;    // weights of v1 and v2
};

// Roundings of another order, or fused ones, change an edge's side by so many halves of a unit in the last place of its
// largest terms, and a distance: twice what they add up to.
RCS_CONSTANT float kRcsRoomOfSide = 9.5367432e-7f;
RCS_CONSTANT float kRcsRoomOfDistance = 2.3841858e-7f;

// @param v0, v1, v2  corners less the ray's origin   @param d  direction, need not be unit
RCS_SHARED_FUNCTION RcsMeeting rcs_meet_triangle(vec3 v0, vec3 v1, vec3 v2, vec3 d)
{
    RcsMeeting m;
    RCS_PRECISE float weight_u = rcs_edge_side(v0, v2, d);
    RCS_PRECISE float weight_v = rcs_edge_side(v1, v0, d);
    RCS_PRECISE float weight_w = rcs_edge_side(v2, v1, d);
    RCS_PRECISE float sum = weight_u + weight_v + weight_w;
    float rounding = 9.5367432e-7f * abs(sum);
    float least = min(min(weight_u, weight_v), weight_w), most = max(max(weight_u, weight_v), weight_w);
    bool inside = least >= -rounding || most <= rounding;
    RCS_PRECISE float ax = v2.x - v0.x, ay = v2.y - v0.y, az = v2.z - v0.z;
    RCS_PRECISE float bx = v0.x - v1.x, by = v0.y - v1.y, bz = v0.z - v1.z;
    RCS_PRECISE float cx = v1.x - v2.x, cy = v1.y - v2.y, cz = v1.z - v2.z;
    vec3 n;
    n.x = rcs_normal_component(ay, az, by, bz, cy, cz);
    n.y = rcs_normal_component(az, ax, bz, bx, cz, cx);
    n.z = rcs_normal_component(ax, ay, bx, by, cx, cy);
    RCS_PRECISE float slope = n.x * d.x + n.y * d.y + n.z * d.z;
    RCS_PRECISE float height = n.x * v0.x + n.y * v0.y + n.z * v0.z;
    float edges = max(max(max(abs(ax), abs(ay)), max(abs(az), abs(bx))),
                      max(max(abs(by), abs(bz)), max(max(abs(cx), abs(cy)), abs(cz))));
    float room = rounding + kRcsRoomOfSide * 2.0f * edges * max(max(rcs_extent(v0), rcs_extent(v1)), rcs_extent(v2)) *
                                rcs_extent(d);
    m.meets = inside && slope != 0.0f;
    m.near = least >= -room || most <= room;
    m.doubted = m.near && !(least > room || most < -room);
    m.normal = n;
    m.t = slope != 0.0f ? height / slope : 0.0f;
    m.t_room = kRcsRoomOfDistance * (abs(n.x * v0.x) + abs(n.y * v0.y) + abs(n.z * v0.z)) / abs(slope);
    m.u = sum != 0.0f ? min(weight_u / sum, 1.0f) : 0.0f;
    m.v = sum != 0.0f ? min(weight_v / sum, 1.0f) : 0.0f;
    return m;
}

#ifdef __cplusplus
}  // namespace gpu
}  // namespace rcs
#endif
