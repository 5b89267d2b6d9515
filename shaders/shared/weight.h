// How much a record counts at a point, and what it says there: the one definition that C++ (tiles) and
// GLSL (quads) compile. Vectors are three scalars, so that loops over pixels vectorise.
//
// d = p - p_k, the point relative to the record; n its normal; n_k the record's.
#ifdef __cplusplus
#pragma once
#endif
#include "shared/language.h"
#ifdef __cplusplus
namespace rcs {
namespace gpu {
#endif

// Interpolation weight: Ward's split-sphere error measure (Ward et al. 1988), with the distance relative to
// the influence radius and the change of normal to its tolerance, in the bounded form of Tabellion and
// Lamorlette 2004: 1 at the record, falling to 0 at the rim of its influence, so nothing pops or diverges.
// The distance across the record's tangent plane counts twice, so its square is added 2^2 - 1 times more: a step is
// another surface. That is in none of these papers; docs/method.md says what it was measured to gain.
RCS_SHARED_FUNCTION float rcs_interpolation_weight(vec3 d, vec3 n, vec3 n_k, float inv_radius,
                                                   float inv_normal_tolerance)
{
    float across = d.x * n_k.x + d.y * n_k.y + d.z * n_k.z;
    float distance2 = d.x * d.x + d.y * d.y + d.z * d.z + 3.0f * across * across;
    float turned = max(0.0f, 1.0f - (n.x * n_k.x + n.y * n_k.y + n.z * n_k.z));
    float error = sqrt(distance2) * inv_radius + sqrt(turned) * inv_normal_tolerance;
    return max(0.0f, 1.0f - error);
}

// First-order extrapolation of one colour of the record's irradiance (Ward and Heckbert 1992, eq. 1), never
// negative. r = cross(n_k, n); gt, gr: translation and rotation gradient.
RCS_SHARED_FUNCTION float rcs_extrapolate(float e, vec3 d, vec3 r, vec3 gt, vec3 gr)
{
    float change = d.x * gt.x + d.y * gt.y + d.z * gt.z + r.x * gr.x + r.y * gr.y + r.z * gr.z;
    return max(0.0f, e + change);
}

RCS_SHARED_FUNCTION float rcs_luminance(float r, float g, float b) { return 0.2126f * r + 0.7152f * g + 0.0722f * b; }

// What a record's glossy light at a pixel is multiplied with. Its radiance is weighted by the cosine to the record's
// normal, not the pixel's: uniform radiance, which has to be reflected as it is, tells by how much that is off.
// @param uniform_light  the lobe's reflection of uniform radiance as the record would hold it, times pi / irradiance
RCS_SHARED_FUNCTION float rcs_radiance_scale(float uniform_light)
{
    return 1.0f / max(0.25f * 0.318309886f, uniform_light) * 0.318309886f;
}

#ifdef __cplusplus
}  // namespace gpu
}  // namespace rcs
#endif
