// How the surfaces of a scene lie in the buffers of pass rays: read by C++ and GLSL.
#ifdef __cplusplus
#pragma once
#endif
#include "shared/language.h"

// What a node's child is, in one word: a node by its index, or a leaf. A leaf holds 1 to 8 triangles that lie one
// behind the other (bits 27 to 29: how many less 1, below them the first), or one instance.
#define RCS_DEVICE_LEAF 0x80000000u
#define RCS_DEVICE_INSTANCE_LEAF 0xc0000000u
#define RCS_DEVICE_NOTHING 0xffffffffu
#define RCS_DEVICE_FIRST_MASK 0x07ffffffu
#define RCS_DEVICE_COUNT_SHIFT 27

// In place of an instance: the ray met nothing, or only the processor can tell what.
#define RCS_DEVICE_MISS 0xffffffffu
#define RCS_DEVICE_UNDECIDED 0xfffffffeu
// What becomes of shadow rays.
#define RCS_DEVICE_FREE 0u
#define RCS_DEVICE_BLOCKED 1u
#define RCS_DEVICE_ASK 2u
// Of a triangle: rays may go on through it.
#define RCS_DEVICE_SEE_THROUGH 1u

// Words that are still to be visited: three a level of both hierarchies together, and what they begin with.
#define RCS_DEVICE_STACK 128

// In uvec4. A node: the corner that its boxes are relative to, as floats, and the exponents of their steps (a byte
// each); four children; a byte a child: least x, y, z, most x; then most y and z.
#define RCS_DEVICE_NODE_WORDS 4
// Three corners, as floats; in w the instance, the primitive, and what rays do.
#define RCS_DEVICE_TRIANGLE_WORDS 3
// Rows of the affine map from scene to object, as floats; the root of its hierarchy, its number, and nothing.
#define RCS_DEVICE_INSTANCE_WORDS 4

#ifdef __cplusplus
namespace rcs {
namespace gpu {
#endif

// Where a box has its side. @param step  a power of two, so that there is one rounding alone
RCS_SHARED_FUNCTION float rcs_box_side(float corner, float steps, float step)
{
    RCS_PRECISE float side = corner + steps * step;
    return side;
}

#ifdef __cplusplus
}  // namespace gpu
}  // namespace rcs
#endif
