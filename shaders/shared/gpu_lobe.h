// Lobes that records light, as pass lobes reads them (std430): read by C++ and GLSL.
#ifdef __cplusplus
#pragma once
#include <glm/glm.hpp>
namespace rcs {
namespace gpu {
using glm::vec4;
#endif

#define RCS_LOBE_BANDS 6     // of harmonics; 36 of these
#define RCS_LOBE_ALPHAS 8    // roughnesses of a fit, from the least that records light to 1
#define RCS_LOBE_COSINES 16  // between normal and viewer, from the least to 1
#define RCS_LOBE_LEAST_COSINE 0.03

// A fit for one roughness and cosine.
struct GpuFittedLobe {
    vec4 weights[9];  // of zonal harmonic l about axis j, number 6 l + j
    vec4 albedo;      // x: integral of f cos; the others unused
};

// What all of them take.
struct GpuLobeFits {
    float start[RCS_LOBE_BANDS];               // factors of the harmonics' recurrences (radiance/harmonics.h)
    float a[RCS_LOBE_BANDS * RCS_LOBE_BANDS];  // of l, m: number 6 l + m
    float b[RCS_LOBE_BANDS * RCS_LOBE_BANDS];
    float unused[2];
    // By roughness, then cosine: for Fresnel 1, then for Schlick's grazing term alone.
    GpuFittedLobe fits[2 * RCS_LOBE_ALPHAS * RCS_LOBE_COSINES];
};

#ifdef __cplusplus
static_assert(sizeof(GpuFittedLobe) == 160);
static_assert(sizeof(GpuLobeFits) == 320 + sizeof(GpuFittedLobe) * 2 * RCS_LOBE_ALPHAS * RCS_LOBE_COSINES);
}  // namespace gpu
}  // namespace rcs
#endif
