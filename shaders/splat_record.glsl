// What one record adds to one pixel: for quads (splat.frag) and for tiles (splat_tiles.comp). Variants: RCS_SPLAT_GLOSSY
// also lights lobes, RCS_SPLAT_ERRORS also sums up what the error estimate takes. A file that defines
// RCS_SPLAT_ONE_RECORD adds one at each pixel: lobes are read where it weighs anything, else once for all.
#include "shared/bindings.h"
#include "shared/gpu_record.h"
#include "shared/weight.h"

layout(std430, binding = RCS_SPLAT_BUFFER_RECORDS) readonly buffer Records
{
    GpuRecord records[];
};
layout(binding = RCS_SPLAT_TEXTURE_POSITION) uniform sampler2D positions;
layout(binding = RCS_SPLAT_TEXTURE_NORMAL) uniform sampler2D normals;
layout(location = RCS_SPLAT_UNIFORM_IMAGE_SIZE) uniform ivec2 image_size;

#ifdef RCS_SPLAT_GLOSSY
layout(std430, binding = RCS_SPLAT_BUFFER_RADIANCE) readonly buffer Radiances
{
    GpuRadiance radiances[];
};
layout(std430, binding = RCS_SPLAT_BUFFER_LOBES) readonly buffer Lobes
{
    vec4 lobes[];  // nine for each pixel of the band
};
#endif

// What a pixel sees.
struct SeenPoint {
    vec3 position, normal;
    bool covered;
#ifdef RCS_SPLAT_GLOSSY
    int first_lobe;
    vec4 lobe[9];  // its coefficients
#endif
};

// What a record adds to the targets.
struct Share {
    vec4 sums;
    vec4 error;
    vec4 glossy;
};

#ifdef RCS_SPLAT_GLOSSY
void read_lobe(inout SeenPoint seen)
{
    for (int k = 0; k < 9; ++k) seen.lobe[k] = lobes[seen.first_lobe + k];
}
#endif

// @param pixel  of the band
SeenPoint seen_at(ivec2 pixel)
{
    vec4 position = texelFetch(positions, pixel, 0);
    SeenPoint seen;
    seen.position = position.xyz;
    seen.normal = texelFetch(normals, pixel, 0).xyz;
    seen.covered = position.w != 0.0;
#ifdef RCS_SPLAT_GLOSSY
    seen.first_lobe = 9 * (pixel.y * image_size.x + pixel.x);
#ifndef RCS_SPLAT_ONE_RECORD
    read_lobe(seen);
#endif
#endif
    return seen;
}

#ifdef RCS_SPLAT_GLOSSY
// The lobe's reflection of the record's radiance, over that of uniform radiance.
float reflected(int record, int color, vec4 lobe[9])
{
    float sum = 0.0;
    for (int k = 0; k < 9; ++k) sum += dot(lobe[k], radiances[record].coefficients[9 * color + k]);
    return sum;
}
#endif

float extrapolate(int record, int color, vec3 d, vec3 r)
{
    return rcs_extrapolate(records[record].irradiance[color], d, r, records[record].translation_gradient[color].xyz,
                           records[record].rotation_gradient[color].xyz);
}

// @return whether it adds anything
bool add_record(int record, SeenPoint seen, out Share share)
{
    vec4 record_position = records[record].position;
    vec4 record_normal = records[record].normal;
    vec3 d = seen.position - record_position.xyz;
    float weight =
        rcs_interpolation_weight(d, seen.normal, record_normal.xyz, record_position.w, record_normal.w);
    share = Share(vec4(0.0), vec4(0.0), vec4(0.0));
    if (weight <= 0.0) return false;

    vec3 r = cross(record_normal.xyz, seen.normal);
    vec3 e = vec3(extrapolate(record, 0, d, r), extrapolate(record, 1, d, r), extrapolate(record, 2, d, r));
    share.sums = vec4(weight * e, weight);
#ifdef RCS_SPLAT_ERRORS
    float l = records[record].irradiance.w * rcs_luminance(e.r, e.g, e.b);
    float variance = weight * records[record].rotation_gradient[0].w;
    share.error = vec4(weight * l * l, variance, weight * variance, 0.0);
#endif
#ifdef RCS_SPLAT_GLOSSY
#ifdef RCS_SPLAT_ONE_RECORD
    read_lobe(seen);
#endif
    vec3 radiance =
        vec3(reflected(record, 0, seen.lobe), reflected(record, 1, seen.lobe), reflected(record, 2, seen.lobe));
    float scale = rcs_radiance_scale(reflected(record, 3, seen.lobe));
    share.glossy = vec4(share.sums.rgb * scale * max(vec3(0.0), radiance), 0.0);
#endif
    return true;
}
