#version 450 core
// What one record adds to one pixel. Variants: RCS_SPLAT_GLOSSY also lights lobes, RCS_SPLAT_ERRORS also sums up what
// the error estimate takes.
#include "shared/bindings.h"
#include "shared/gpu_record.h"
#include "shared/weight.h"

layout(std430, binding = RCS_SPLAT_BUFFER_RECORDS) readonly buffer Records
{
    GpuRecord records[];
};
layout(binding = RCS_SPLAT_TEXTURE_POSITION) uniform sampler2D positions;
layout(binding = RCS_SPLAT_TEXTURE_NORMAL) uniform sampler2D normals;

flat in int record_index;

layout(location = RCS_SPLAT_TARGET_SUMS) out vec4 sums;    // blend: add
layout(location = RCS_SPLAT_TARGET_COUNT) out float count; // blend: add
#ifdef RCS_SPLAT_ERRORS
layout(location = RCS_SPLAT_TARGET_ERROR) out vec4 error;  // blend: add
#endif

#ifdef RCS_SPLAT_GLOSSY
layout(std430, binding = RCS_SPLAT_BUFFER_RADIANCE) readonly buffer Radiances
{
    GpuRadiance radiances[];
};
layout(std430, binding = RCS_SPLAT_BUFFER_LOBES) readonly buffer Lobes
{
    vec4 lobes[];  // nine for each pixel of the band
};
layout(location = RCS_SPLAT_UNIFORM_IMAGE_SIZE) uniform ivec2 image_size;
layout(location = RCS_SPLAT_TARGET_GLOSSY) out vec4 glossy; // blend: add

// The lobe's reflection of the record's radiance, over that of uniform radiance.
float reflected(int color, int first_lobe)
{
    float sum = 0.0;
    for (int k = 0; k < 9; ++k)
        sum += dot(lobes[first_lobe + k], radiances[record_index].coefficients[9 * color + k]);
    return sum;
}
#endif

float extrapolate(int color, vec3 d, vec3 r)
{
    return rcs_extrapolate(records[record_index].irradiance[color], d, r,
                           records[record_index].translation_gradient[color].xyz,
                           records[record_index].rotation_gradient[color].xyz);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 position = texelFetch(positions, pixel, 0);
    if (position.w == 0.0) discard;
    vec3 n = texelFetch(normals, pixel, 0).xyz;

    vec4 record_position = records[record_index].position;
    vec4 record_normal = records[record_index].normal;
    vec3 d = position.xyz - record_position.xyz;
    float weight = rcs_interpolation_weight(d, n, record_normal.xyz, record_position.w, record_normal.w);
    if (weight <= 0.0) discard;

    vec3 r = cross(record_normal.xyz, n);
    vec3 e = vec3(extrapolate(0, d, r), extrapolate(1, d, r), extrapolate(2, d, r));
    sums = vec4(weight * e, weight);
    count = 1.0;
#ifdef RCS_SPLAT_ERRORS
    float l = records[record_index].irradiance.w * rcs_luminance(e.r, e.g, e.b);
    float variance = weight * records[record_index].rotation_gradient[0].w;
    error = vec4(weight * l * l, variance, weight * variance, 0.0);
#endif
#ifdef RCS_SPLAT_GLOSSY
    int first_lobe = 9 * (pixel.y * image_size.x + pixel.x);
    vec3 radiance = vec3(reflected(0, first_lobe), reflected(1, first_lobe), reflected(2, first_lobe));
    float scale = rcs_radiance_scale(reflected(3, first_lobe));
    glossy = vec4(sums.rgb * scale * max(vec3(0.0), radiance), 0.0);
#endif
}
