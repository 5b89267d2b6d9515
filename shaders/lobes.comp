#version 450 core
// Coefficients of the lobes that records light, a pixel an invocation: what evaluate_lobes() of
// librcs/src/radiance/lobes.h finds, which says what they are.
#include "shared/bindings.h"
#include "shared/gpu_lobe.h"

layout(local_size_x = RCS_LOBES_GROUP, local_size_y = RCS_LOBES_GROUP) in;

layout(std430, binding = RCS_LOBES_BUFFER_FITS) readonly buffer Fits
{
    GpuLobeFits all;
};
layout(std430, binding = RCS_SPLAT_BUFFER_LOBES) writeonly buffer Lobes
{
    vec4 lobes[];  // nine for each pixel of the band
};
layout(binding = RCS_SPLAT_TEXTURE_POSITION) uniform sampler2D positions;
layout(binding = RCS_SPLAT_TEXTURE_NORMAL) uniform sampler2D normals;
layout(binding = RCS_LOBES_TEXTURE_LOBE) uniform sampler2D kinds;
layout(location = RCS_SPLAT_UNIFORM_IMAGE_SIZE) uniform ivec2 band_size;
layout(location = RCS_LOBES_UNIFORM_TOWARD) uniform vec4 toward;

const int kBands = RCS_LOBE_BANDS;
// Of the axes' angles, j pi / 6: how exact a sine is GL does not say.
const float kSines[kBands] = float[kBands](0.0, 0.5, 0.866025404, 1.0, 0.866025404, 0.5);
const float kCosines[kBands] = float[kBands](1.0, 0.866025404, 0.5, 0.0, -0.5, -0.866025404);

// Node below x in [0, 1], and how far beyond it.
int node(float x, int nodes, out float fraction)
{
    float at = clamp(x, 0.0, 1.0) * float(nodes - 1);
    int i = min(int(at), nodes - 2);
    fraction = at - float(i);
    return i;
}

// A lobe between the fits.
struct Mixture {
    int first[4];
    float share[4];
    float of_grey, of_grazing, scale;
};

const int kGrazing = RCS_LOBE_ALPHAS * RCS_LOBE_COSINES;

Mixture mixture_of(vec4 kind, float cosine)
{
    Mixture m;
    float s, c;
    int i = node(kind.x, RCS_LOBE_ALPHAS, s);
    int j = node((cosine - RCS_LOBE_LEAST_COSINE) / (1.0 - RCS_LOBE_LEAST_COSINE), RCS_LOBE_COSINES, c);
    int at = RCS_LOBE_COSINES * i + j;
    m.first = int[4](at, at + 1, at + RCS_LOBE_COSINES, at + RCS_LOBE_COSINES + 1);
    m.share = float[4]((1.0 - s) * (1.0 - c), (1.0 - s) * c, s * (1.0 - c), s * c);
    m.of_grey = kind.y;
    m.of_grazing = kind.z;
    float albedo = 0.0;
    for (int k = 0; k < 4; ++k)
        albedo += m.share[k] * (m.of_grey * all.fits[m.first[k]].albedo.x +
                                m.of_grazing * all.fits[kGrazing + m.first[k]].albedo.x);
    m.scale = albedo > 0.0 ? 1.0 / albedo : 0.0;
    return m;
}

// Of zonal harmonic l about axis j, number 6 l + j.
float weight_of(Mixture m, int w)
{
    float sum = 0.0;
    for (int k = 0; k < 4; ++k)
        sum += m.share[k] * (m.of_grey * all.fits[m.first[k]].weights[w / 4][w % 4] +
                             m.of_grazing * all.fits[kGrazing + m.first[k]].weights[w / 4][w % 4]);
    return m.scale * sum;
}

// Adds the zonal harmonics about one axis, of these weights by band.
void add_axis(vec3 axis, float weights[kBands], inout float sum[kBands * kBands])
{
    float c = 1.0, s = 0.0;  // sin(theta)^m cos(m phi), sin(theta)^m sin(m phi)
    for (int m = 0; m < kBands; ++m) {
        float previous = 0.0, last = all.start[m];
        for (int l = m; l < kBands; ++l) {
            if (l > m) {
                float p = all.a[kBands * l + m] * axis.z * last - all.b[kBands * l + m] * previous;
                previous = last;
                last = p;
            }
            if (m > 0) sum[l * (l + 1) - m] += weights[l] * last * s;
            sum[l * (l + 1) + m] += weights[l] * last * c;
        }
        float next = c * axis.x - s * axis.y;
        s = s * axis.x + c * axis.y;
        c = next;
    }
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= band_size.x || pixel.y >= band_size.y) return;
    vec4 kind = texelFetch(kinds, pixel, 0);
    float sum[kBands * kBands];
    for (int k = 0; k < kBands * kBands; ++k) sum[k] = 0.0;
    if (kind.w != 0.0) {
        vec3 normal = texelFetch(normals, pixel, 0).xyz;
        vec3 outgoing = toward.w != 0.0 ? toward.xyz : -normalize(texelFetch(positions, pixel, 0).xyz);
        float cosine = dot(normal, outgoing);
        vec3 across = outgoing - cosine * normal;
        float length2 = dot(across, across);
        // Seen squarely, the lobe is round: any tangent does.
        vec3 other = abs(normal.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
        vec3 tangent = length2 > 1e-12 ? across / sqrt(length2) : normalize(cross(normal, other));
        Mixture m = mixture_of(kind, cosine);
        for (int j = 0; j < kBands; ++j) {
            float weights[kBands];
            for (int l = 0; l < kBands; ++l) weights[l] = weight_of(m, kBands * l + j);
            add_axis(kSines[j] * tangent + kCosines[j] * normal, weights, sum);
        }
    }
    int first = 9 * (pixel.y * band_size.x + pixel.x);
    for (int k = 0; k < 9; ++k)
        lobes[first + k] = vec4(sum[4 * k], sum[4 * k + 1], sum[4 * k + 2], sum[4 * k + 3]);
}
