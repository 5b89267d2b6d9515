#version 450 core
// One ray an invocation: the nearest surface that it meets, or, with RCS_RAYS_SHADOW, whether any is in its way. Where
// roundings decide, as at edges and where two surfaces meet, or a surface may let the ray through, the processor is
// asked.
#include "shared/bindings.h"
#include "shared/device_scene.h"
#include "shared/ray_triangle.h"

layout(local_size_x = RCS_RAYS_GROUP) in;

layout(std430, binding = RCS_RAYS_BUFFER_NODES) readonly buffer Nodes
{
    uvec4 nodes[];
};
layout(std430, binding = RCS_RAYS_BUFFER_TRIANGLES) readonly buffer Triangles
{
    uvec4 triangles[];
};
layout(std430, binding = RCS_RAYS_BUFFER_INSTANCES) readonly buffer Instances
{
    uvec4 instances[];
};
layout(std430, binding = RCS_RAYS_BUFFER_RAYS) readonly buffer Rays
{
    vec4 rays[];
};
#ifdef RCS_RAYS_SHADOW
layout(std430, binding = RCS_RAYS_BUFFER_RESULTS) writeonly buffer Results
{
    uint results[];
};
#else
layout(std430, binding = RCS_RAYS_BUFFER_RESULTS) writeonly buffer Results
{
    uvec4 results[];
};
#endif
layout(location = RCS_RAYS_UNIFORM_COUNT) uniform uint count;
layout(location = RCS_RAYS_UNIFORM_ROOTS) uniform uvec2 roots;

// Some roundings of a distance to a box, with room to spare.
const float kRoom = 1e-6;
const float kNowhere = 3.0e38;

// No component so small that its inverse is infinite: that times zero is no number.
vec3 inverse_of(vec3 d)
{
    float least = 1e-18 * max(max(abs(d.x), abs(d.y)), abs(d.z));
    return vec3(1.0 / (abs(d.x) < least ? (d.x < 0.0 ? -least : least) : d.x),
                1.0 / (abs(d.y) < least ? (d.y < 0.0 ? -least : least) : d.y),
                1.0 / (abs(d.z) < least ? (d.z < 0.0 ? -least : least) : d.z));
}

vec4 bytes(uint word) { return vec4(word & 255u, word >> 8 & 255u, word >> 16 & 255u, word >> 24); }

vec4 sides(float corner, uint steps, float step)
{
    vec4 b = bytes(steps);
    return vec4(rcs_box_side(corner, b.x, step), rcs_box_side(corner, b.y, step), rcs_box_side(corner, b.z, step),
                rcs_box_side(corner, b.w, step));
}

void later_first(inout vec4 t, inout uvec4 ref, int a, int b)
{
    if (t[a] >= t[b]) return;
    float t_a = t[a];
    t[a] = t[b];
    t[b] = t_a;
    uint ref_a = ref[a];
    ref[a] = ref[b];
    ref[b] = ref_a;
}

void main()
{
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    vec4 start = rays[2u * ray], way = rays[2u * ray + 1u];
    float end = start.w;
    vec3 o = start.xyz, d = way.xyz, inverse = inverse_of(d);
#ifdef RCS_RAYS_SHADOW
    uint found = RCS_DEVICE_FREE;
#else
    vec3 weights = vec3(0.0), normal = vec3(0.0);
    uint hit_instance = RCS_DEVICE_MISS, hit_primitive = 0xffffffffu;
    bool goes_on = false;
    float doubt = kNowhere;  // nearest place where roundings decide what is met
#endif
    uint stack[RCS_DEVICE_STACK];
    int top = 0, below_instance = -1;
    uint of_instance = RCS_DEVICE_MISS;
    if (roots.y != RCS_DEVICE_NOTHING) stack[top++] = roots.y;
    uint ref = end >= 0.0 ? roots.x : RCS_DEVICE_NOTHING;
    if (end < 0.0) top = 0;
    while (true) {
        if ((ref & RCS_DEVICE_LEAF) == 0u) {
            uint at = RCS_DEVICE_NODE_WORDS * ref;
            uvec4 head = nodes[at], child = nodes[at + 1u], low = nodes[at + 2u], high = nodes[at + 3u];
            vec3 corner = uintBitsToFloat(head.xyz);
            vec3 step = uintBitsToFloat(uvec3(head.w & 255u, head.w >> 8 & 255u, head.w >> 16 & 255u) << 23);
            vec4 x0 = (sides(corner.x, low.x, step.x) - o.x) * inverse.x;
            vec4 x1 = (sides(corner.x, low.w, step.x) - o.x) * inverse.x;
            vec4 y0 = (sides(corner.y, low.y, step.y) - o.y) * inverse.y;
            vec4 y1 = (sides(corner.y, high.x, step.y) - o.y) * inverse.y;
            vec4 z0 = (sides(corner.z, low.z, step.z) - o.z) * inverse.z;
            vec4 z1 = (sides(corner.z, high.y, step.z) - o.z) * inverse.z;
            vec4 enter = max(max(min(x0, x1), min(y0, y1)), min(z0, z1));
            vec4 leave = min(min(max(x0, x1), max(y0, y1)), max(z0, z1));
            enter = max(enter - kRoom * abs(enter), vec4(0.0));
            leave = min(leave + kRoom * abs(leave), vec4(end));
            // Those that are missed come first, then the farthest.
            vec4 t = mix(vec4(kNowhere), enter, lessThanEqual(enter, leave));
            for (int k = 0; k < 4; ++k)
                if (!(enter[k] <= leave[k])) child[k] = RCS_DEVICE_NOTHING;
#ifndef RCS_RAYS_SHADOW
            later_first(t, child, 0, 1);
            later_first(t, child, 2, 3);
            later_first(t, child, 0, 2);
            later_first(t, child, 1, 3);
            later_first(t, child, 1, 2);
#endif
            for (int k = 0; k < 4; ++k)
                if (child[k] != RCS_DEVICE_NOTHING) stack[top++] = child[k];
        } else if (ref != RCS_DEVICE_NOTHING && (ref & RCS_DEVICE_INSTANCE_LEAF) == RCS_DEVICE_INSTANCE_LEAF) {
            uint at = RCS_DEVICE_INSTANCE_WORDS * (ref & RCS_DEVICE_FIRST_MASK);
            vec4 x = uintBitsToFloat(instances[at]), y = uintBitsToFloat(instances[at + 1u]),
                 z = uintBitsToFloat(instances[at + 2u]);
            uvec4 tail = instances[at + 3u];
            o = vec3(dot(x, vec4(start.xyz, 1.0)), dot(y, vec4(start.xyz, 1.0)), dot(z, vec4(start.xyz, 1.0)));
            d = vec3(dot(x.xyz, way.xyz), dot(y.xyz, way.xyz), dot(z.xyz, way.xyz));
            inverse = inverse_of(d);
            below_instance = top;
            of_instance = tail.y;
            stack[top++] = tail.x;
        } else if (ref != RCS_DEVICE_NOTHING) {
            uint first = ref & RCS_DEVICE_FIRST_MASK;
            uint last = first + (ref >> RCS_DEVICE_COUNT_SHIFT & 7u);
            for (uint k = first; k <= last; ++k) {
                uvec4 a = triangles[RCS_DEVICE_TRIANGLE_WORDS * k], b = triangles[RCS_DEVICE_TRIANGLE_WORDS * k + 1u],
                      c = triangles[RCS_DEVICE_TRIANGLE_WORDS * k + 2u];
                RcsMeeting m = rcs_meet_triangle(uintBitsToFloat(a.xyz) - o, uintBitsToFloat(b.xyz) - o,
                                                 uintBitsToFloat(c.xyz) - o, d);
                // Beyond either end by all means; also false for what is no number.
                if (!m.near || m.t < -m.t_room || m.t > end + m.t_room) continue;
                bool see_through = c.w == RCS_DEVICE_SEE_THROUGH;
                bool in_between = m.t > m.t_room && m.t < end - m.t_room;
#ifdef RCS_RAYS_SHADOW
                found = see_through || m.doubted || !in_between ? RCS_DEVICE_ASK : RCS_DEVICE_BLOCKED;
                if (found == RCS_DEVICE_BLOCKED) break;
#else
                if (m.doubted || !in_between) doubt = min(doubt, m.t_room < end ? m.t - m.t_room : 0.0);
                if (!m.meets || !(m.t >= 0.0 && m.t <= end)) continue;
                uint instance = of_instance == RCS_DEVICE_MISS ? a.w : of_instance;
                // Of two at the same place always the same one.
                if (m.t == end && (instance > hit_instance || (instance == hit_instance && b.w > hit_primitive)))
                    continue;
                end = m.t;
                weights = vec3(m.t, m.u, m.v);
                normal = m.normal;
                hit_instance = instance;
                hit_primitive = b.w;
                goes_on = see_through;
#endif
            }
#ifdef RCS_RAYS_SHADOW
            if (found == RCS_DEVICE_BLOCKED) break;
#endif
        }
        if (top == below_instance) {
            o = start.xyz;
            d = way.xyz;
            inverse = inverse_of(d);
            below_instance = -1;
            of_instance = RCS_DEVICE_MISS;
        }
        if (top == 0) break;
        ref = stack[--top];
    }
#ifdef RCS_RAYS_SHADOW
    results[ray] = found;
#else
    bool undecided = goes_on || (doubt < kNowhere && doubt <= end);
    results[2u * ray] = uvec4(floatBitsToUint(weights), undecided ? RCS_DEVICE_UNDECIDED : hit_instance);
    results[2u * ray + 1u] = uvec4(floatBitsToUint(normal), hit_primitive);
#endif
}
